"use strict";
// Draw all figures from top to bottom; then connect the rows of the joint table to the 3D view.

// Resolves after the browser has painted texts and tables.
const painted = () => new Promise((done) => requestAnimationFrame(() => setTimeout(done)));

async function start() {
  await painted();
  for (const place of document.querySelectorAll("[data-figure], [data-scene]")) {
    await (place.dataset.figure === undefined ? drawScene(place) : drawFigure(place));
  }
  document.querySelectorAll("tr[data-joint]").forEach((row) => {
    row.tabIndex = 0;
    row.addEventListener("click", () => pickJoint(row));
    row.addEventListener("keydown", (event) => event.key === "Enter" && pickJoint(row));
  });
  document.documentElement.dataset.ready = "yes";
}

const hasWebGL = document.querySelector("[data-scene]") && document.createElement("canvas").getContext("webgl2") !== null;

async function drawScene(place) {
  if (!hasWebGL) {
    place.append(element("p", { className: "note" }, "The 3D view needs WebGL 2, which this browser does not offer."));
    return;
  }
  place.viewer = await new Viewer(place, page.scenes[Number(place.dataset.scene)]).build();
}

function pickJoint(row) {
  const place = document.querySelector("#view-3d .scene");
  if (!place || !place.viewer) return;
  const again = row.classList.contains("picked");
  document.querySelectorAll("tr.picked").forEach((one) => one.classList.remove("picked"));
  if (place.viewer.showPart(again ? "" : row.dataset.joint) && !again) {
    row.classList.add("picked");
    place.scrollIntoView({ block: "center", behavior: "smooth" });
  }
}

start();
