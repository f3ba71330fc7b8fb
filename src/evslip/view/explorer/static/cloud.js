// Events in space and time, drawn by Plotly, which is fetched when it is first asked for.
const SPAN_US = 600000;
let library;

function load() {
  library ??= new Promise((resolve, reject) => {
    const script = document.createElement("script");
    script.src = "/plotly.js";
    script.onload = resolve;
    script.onerror = () => reject(new Error("Plotly could not be loaded"));
    document.head.append(script);
  });
  return library;
}

export async function drawCloud(place, position, about, t) {
  const start = Math.round(Math.max(about.start_us, Math.min(t - SPAN_US / 2, about.end_us - SPAN_US)));
  const [answer] = await Promise.all([
    fetch(`/api/samples/${position}/cloud?start_us=${start}&end_us=${start + SPAN_US}`), load()]);
  if (!answer.ok) throw new Error(await answer.text());
  const figure = await answer.json();
  const style = getComputedStyle(document.documentElement);
  const layout = {...figure.layout, height: 460, paper_bgcolor: "rgba(0,0,0,0)", font: {color: style.getPropertyValue("--text").trim()}};
  layout.scene = {...layout.scene};
  for (const axis of ["xaxis", "yaxis", "zaxis"])
    layout.scene[axis] = {showbackground: false, gridcolor: style.getPropertyValue("--line").trim(), ...layout.scene[axis]};
  await Plotly.react(place, figure.data, layout, {responsive: true, displaylogo: false});
  place.dataset.drawn = "yes";
}
