"""Everything that `evslip evaluate` finds out about detectors. Begin with `assessment.assess`."""
