// Draws the figures in the page, in the colours of the page.
"use strict";
const figures = JSON.parse(document.getElementById("figures").textContent);
const dark = window.matchMedia("(prefers-color-scheme: dark)");
const touch = window.matchMedia("(pointer: coarse)").matches;

function colours() {
  const style = getComputedStyle(document.documentElement);
  const value = (name) => style.getPropertyValue(name).trim();
  return { text: value("--text"), grid: value("--grid"), paper: value("--card") };
}

function themed(layout) {
  const { text, grid, paper } = colours();
  const result = {
    ...layout,
    paper_bgcolor: "rgba(0,0,0,0)",
    plot_bgcolor: "rgba(0,0,0,0)",
    font: { color: text, size: 12, family: "system-ui, sans-serif" },
    hoverlabel: { bgcolor: paper, bordercolor: grid, font: { color: text } },
    margin: { l: 10, r: 10, t: 30, b: 40 },
    legend: { orientation: "h", x: 0, y: 1, yanchor: "bottom" },
    dragmode: touch ? false : "zoom",
  };
  for (const name of Object.keys(layout).filter((key) => /^[xy]axis/.test(key))) {
    result[name] = { ...layout[name], gridcolor: grid, zerolinecolor: grid, linecolor: grid, automargin: true };
  }
  return result;
}

function draw() {
  for (const [id, figure] of Object.entries(figures)) {
    const options = { responsive: true, displaylogo: false, modeBarButtonsToRemove: ["select2d", "lasso2d"] };
    const layout = themed(figure.layout);
    if (id === "map") layout.height = Math.min(layout.height, 100 + document.getElementById(id).clientWidth);
    Plotly.react(id, figure.data, layout, options);
  }
}

draw();
dark.addEventListener("change", draw);
