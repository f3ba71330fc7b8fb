// Events in space and time, drawn by Plotly, which is fetched when it is first asked for.
import {ask, color, element} from "./page.js";

const SPAN_US = 600000;
let library;

function load() {
  library ??= new Promise((resolve, reject) => {
    const onerror = () => reject(new Error("Plotly could not be loaded"));
    document.head.append(element("script", {src: "/plotly.js", onload: resolve, onerror}));
  });
  return library;
}

export async function drawCloud(place, position, about, t) {
  const start = Math.round(Math.max(about.start_us, Math.min(t - SPAN_US / 2, about.end_us - SPAN_US)));
  const [answer] = await Promise.all([
    ask(`/api/samples/${position}/cloud?start_us=${start}&end_us=${start + SPAN_US}`), load()]);
  const figure = await answer.json();
  const layout = {...figure.layout, height: 460, paper_bgcolor: "rgba(0,0,0,0)", font: {color: color("--text")}};
  layout.scene = {...layout.scene};
  for (const axis of ["xaxis", "yaxis", "zaxis"])
    layout.scene[axis] = {showbackground: false, gridcolor: color("--line"), ...layout.scene[axis]};
  await Plotly.react(place, figure.data, layout, {responsive: true, displaylogo: false});
  place.dataset.drawn = "yes";
}
