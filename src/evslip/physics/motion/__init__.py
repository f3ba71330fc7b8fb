"""Motion of the hand: phases on a time line, the way of the tool, joint angles, clearance.

Begin with `servo_plan.plan`. Kinds of motion are in `evslip.scene.motions`.
"""
