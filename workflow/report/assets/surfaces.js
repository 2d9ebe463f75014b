"use strict";
// Geometry of 3D scenes: triangles and edges of faces, fields derived from displacements, colour bar.

function derived(field, moved, k) {
  const [x, y, z] = [moved[3 * k], moved[3 * k + 1], moved[3 * k + 2]];
  return field.source === "lift" ? z * field.factor : Math.hypot(x, y, z) * field.factor;
}

function share(value, field) {
  return Math.min(Math.max((value - field.low) / (field.high - field.low || 1), 0), 1);
}

function legendOf(field) {
  const bar = element("canvas", { width: 1, height: 100 });
  const context = bar.getContext("2d");
  for (let k = 0; k < 100; k++) {
    context.fillStyle = `rgb(${colourAt(1 - k / 99, field.scale).map(Math.round).join(",")})`;
    context.fillRect(0, k, 1, 1);
  }
  const ticks = [1, 0.75, 0.5, 0.25, 0].map((at) => element("span", {}, shortNumber(Number((field.low + at * (field.high - field.low)).toPrecision(3)))));
  return [element("b", {}, field.label), element("div", { className: "bar" }, bar, element("div", { className: "ticks" }, ...ticks))];
}

function trianglesOf(faces, corners) {
  if (corners === 3) return faces;
  const triangles = new Uint32Array((faces.length / 4) * 6);
  for (let k = 0, m = 0; k < faces.length; k += 4, m += 6) {
    triangles.set([faces[k], faces[k + 1], faces[k + 2], faces[k], faces[k + 2], faces[k + 3]], m);
  }
  return triangles;
}

function edgesOf(faces, corners) {
  const edges = new Uint32Array(2 * faces.length);
  for (let k = 0; k < faces.length; k++) {
    const next = k % corners === corners - 1 ? k - corners + 1 : k + 1;
    edges[2 * k] = faces[k];
    edges[2 * k + 1] = faces[next];
  }
  return edges;
}

function order(groups, mesh) {
  const group = groups.find((one) => one.meshes.includes(mesh));
  return (group.state === 1 ? 2 : 0) + (mesh === group.edges ? 1 : 0);
}
