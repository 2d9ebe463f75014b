"use strict";
// Controls of a 3D view: field, time, displacement scale, visibility of groups, camera.

function toolbar(viewer) {
  const { fields, frames } = viewer.scene;
  const bar = element("div", { className: "toolbar" });
  if (fields.length > 1) bar.append(fieldChoice(viewer));
  if (fields.length) viewer.showField(0);
  if (frames.length > 1) bar.append(...timeControls(viewer));
  if (viewer.groups.some((group) => group.displacement)) bar.append(exaggeration(viewer));
  const names = [...new Set(viewer.groups.map((group) => group.name))];
  viewer.toggles = names.map((name) => toggle(viewer, name));
  bar.append(...viewer.toggles);
  if (viewer.groups.some((group) => group.edges)) bar.append(meshButton(viewer));
  const views = viewer.hasContext ? [["focus", true], ["whole view", false]] : [["whole view", false]];
  bar.append(...views.map(([name, solid]) => button(name, () => viewer.look(solid))));
  return bar;
}

function button(text, act, properties = {}) {
  const made = element("button", { type: "button", ...properties }, text);
  made.addEventListener("click", () => act(made));
  return made;
}

function fieldChoice(viewer) {
  const options = viewer.scene.fields.map((one, k) => element("option", { value: k }, one.label));
  const choice = element("select", { title: "field" }, ...options);
  choice.addEventListener("change", () => viewer.showField(Number(choice.value)));
  return choice;
}

function timeControls(viewer) {
  const { frames } = viewer.scene;
  viewer.slider = element("input", { type: "range", className: "time", min: 0, max: frames.length - 1, step: 1, title: "time" });
  viewer.time = element("output");
  viewer.slider.addEventListener("input", () => viewer.showFrame(Number(viewer.slider.value)));
  let timer = null;
  const play = button("▶", () => {
    if (timer) timer = clearInterval(timer) || null;
    else timer = setInterval(() => viewer.showFrame((viewer.frame + 1) % frames.length), 250);
    play.textContent = timer ? "❚❚" : "▶";
  }, { title: "play" });
  return [play, viewer.slider, viewer.time];
}

function exaggeration(viewer) {
  const most = Math.log10(Math.max(10 * viewer.scene.exaggeration, 10));
  const label = element("output");
  const slider = element("input", { type: "range", min: 0, max: most, step: most / 100, title: "displacement scale" });
  slider.addEventListener("input", () => viewer.setFactor(Number((10 ** Number(slider.value)).toPrecision(2))));
  viewer.factorChanged = () => {
    slider.value = Math.log10(viewer.factor);
    label.textContent = `× ${shortNumber(viewer.factor)}`;
  };
  viewer.factorChanged();
  return element("label", {}, "displacement ", slider, label);
}

function toggle(viewer, name) {
  const members = viewer.groups.filter((group) => group.name === name);
  const made = button("", () => {
    const state = (members[0].state + 1) % STATES.length;
    members.forEach((group) => (group.state = state));
    made.update();
    viewer.wake();
  });
  made.update = () => (made.textContent = `${name}: ${STATES[members[0].state]}`);
  made.update();
  return made;
}

function meshButton(viewer) {
  return button("mesh", (made) => {
    viewer.meshed = !viewer.meshed;
    made.setAttribute("aria-pressed", String(viewer.meshed));
    viewer.wake();
  }, { ariaPressed: "false" });
}
