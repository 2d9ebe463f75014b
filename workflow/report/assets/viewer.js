"use strict";
// 3D scenes: drag to rotate, right-drag to pan, click and scroll to zoom; the slider selects the stored time. A click
// names a body; `showPart` brings one to the front.

const VIEW_HEIGHT = 460;
const GHOST = 0.12;
const STATES = ["shown", "see-through", "hidden"];
const EDGES = [0.16, 0.19, 0.23];

class Viewer {
  constructor(place, scene) {
    Object.assign(this, { place, scene, frame: scene.start, factor: scene.exaggeration, chosen: -1, dirty: 0 });
    this.field = scene.fields.length ? 0 : -1;
    this.canvasBox = element("div", { className: "view" });
    this.tip = element("div", { className: "tip", hidden: true });
    this.width = widthOf(place) - 2; // within its border
    this.renderer = new ogl.Renderer({ width: this.width, height: VIEW_HEIGHT, dpr: Math.min(devicePixelRatio, 2), antialias: true, preserveDrawingBuffer: true });
    this.gl = this.renderer.gl;
    this.gl.clearColor(1, 1, 1, 1);
    this.gl.canvas.tabIndex = 0;
    this.gl.canvas.ariaLabel = "3D view";
    this.labels = scene.labels.map((one) => element("span", { className: "label" }, one.text));
    this.legend = element("div", { className: "legend" });
    this.canvasBox.append(this.gl.canvas, this.legend, this.tip, ...this.labels);
  }

  async build() {
    this.root = new ogl.Transform();
    // One program for all bodies, because compiling is slow without a graphics card.
    this.program = new ogl.Program(this.gl, { vertex: VERTEX, fragment: FRAGMENT, transparent: true });
    this.program.setBlendFunc(this.gl.ONE, this.gl.ONE_MINUS_SRC_ALPHA);
    this.groups = [];
    for (const group of this.scene.groups) this.groups.push(await this.addGroup(group));
    this.hasContext = this.groups.some((group) => group.state === 1);
    this.frameOn(this.hasContext);
    this.camera = new ogl.Camera(this.gl, { fov: 30 });
    this.orbit = new ogl.Orbit(this.camera, {
      element: this.gl.canvas, ease: 1, inertia: 0, rotateSpeed: 1, panSpeed: 1, zoomSpeed: 2,
      minDistance: 0.02 * this.radius,
    });
    this.place.append(toolbar(this), this.canvasBox);
    this.listen();
    this.showFrame(this.frame);
    this.reset();
    this.resize();
    return this;
  }

  async addGroup(group) {
    const gl = this.gl;
    const points = await array(group.points);
    const count = points.length / 3;
    const attributes = {
      position: { size: 3, data: points },
      moved: { size: 3, data: new Float32Array(3 * count), usage: gl.DYNAMIC_DRAW },
      value: { size: 1, data: new Float32Array(count), usage: gl.DYNAMIC_DRAW },
      part: { size: 1, data: Float32Array.from(await array(group.part)) },
    };
    const faces = await array(group.faces);
    const made = {
      ...group, count, attributes, points,
      state: group.ghost ? 1 : 0,
      displacement: group.displacement ? await array(group.displacement.data) : null,
      scale: group.displacement ? group.displacement.scale : 0,
      fieldValues: await Promise.all(group.values.map((one) => (one === null ? null : array(one)))),
      meshes: [],
    };
    made.uniforms = {
      uFactor: { value: 0 }, uSize: { value: 1 }, uNearer: { value: 0 }, uStops: { value: [] }, uCount: { value: 2 },
      uColour: { value: channels(group.colour).map((one) => one / 255) }, uAlpha: { value: 1 }, uChosen: { value: -1 },
      uFlat: { value: 0 }, uPicking: { value: 0 }, uBalls: { value: group.size > 0 ? 1 : 0 },
    };
    const index = (data) => ({ ...attributes, index: { data } });
    if (group.size > 0) this.addMesh(made, attributes, gl.POINTS, made.uniforms);
    else {
      this.addMesh(made, index(trianglesOf(faces, group.corners)), gl.TRIANGLES, made.uniforms);
      const ink = { ...made.uniforms, uColour: { value: EDGES }, uFlat: { value: 1 }, uNearer: { value: 2e-4 } };
      made.edges = this.addMesh(made, index(edgesOf(faces, group.corners)), gl.LINES, ink);
      made.edges.visible = false;
    }
    return made;
  }

  addMesh(group, attributes, mode, uniforms) {
    const { program } = this;
    const mesh = new ogl.Mesh(this.gl, { geometry: new ogl.Geometry(this.gl, attributes), program, mode, frustumCulled: false });
    mesh.onBeforeRender(() => {
      Object.assign(program.uniforms, uniforms);
      program.depthWrite = group.state !== 1;
      program.cullFace = group.state === 1 ? this.gl.BACK : false;
    });
    mesh.setParent(this.root);
    group.meshes.push(mesh);
    return mesh;
  }

  /** Look at all that is solid, following it as it moves as a whole; or at everything, from where it was at rest. */
  frameOn(solid) {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    this.framed = this.groups.filter((group) => group.state === 0 || (!solid && group.state === 1));
    this.follows = solid;
    const written = Float32Array.from(this.scene.labels.flatMap((label) => label.at));
    for (const { points } of [...(this.framed.length ? this.framed : this.groups), { points: written }]) {
      for (let k = 0; k < points.length; k++) {
        low[k % 3] = Math.min(low[k % 3], points[k]);
        high[k % 3] = Math.max(high[k % 3], points[k]);
      }
    }
    this.middle = low.map((one, k) => 0.5 * (one + high[k]));
    this.extent = low.map((one, k) => high[k] - one);
    this.radius = 0.5 * Math.hypot(...this.extent) || 1;
  }

  showFrame(frame) {
    this.frame = frame;
    for (const group of this.groups) {
      const first = 3 * frame * group.count;
      if (group.displacement) {
        const { data } = group.attributes.moved;
        for (let k = 0; k < data.length; k++) data[k] = group.scale * group.displacement[first + k];
        group.attributes.moved.needsUpdate = true;
      }
      this.fill(group);
    }
    this.drift = this.meanMotion();
    if (this.slider) {
      this.slider.value = frame;
      this.time.textContent = this.scene.frames[frame];
    }
    this.tellAgain();
    this.wake();
  }

  /** Return the mean displacement of what is looked at. */
  meanMotion() {
    const sum = [0, 0, 0];
    let count = 0;
    for (const group of this.framed.filter((one) => one.displacement)) {
      const { data } = group.attributes.moved;
      for (let k = 0; k < data.length; k++) sum[k % 3] += data[k];
      count += group.count;
    }
    return sum.map((one) => one / (count || 1));
  }

  fill(group) {
    const { data } = group.attributes.value;
    const field = this.scene.fields[this.field];
    const moved = group.attributes.moved.data;
    const values = this.field < 0 ? null : group.fieldValues[this.field];
    if (field && field.source !== "values" && group.displacement) {
      for (let k = 0; k < group.count; k++) data[k] = share(derived(field, moved, k), field);
    } else if (values) {
      const first = values.length > group.count ? this.frame * group.count : 0;
      for (let k = 0; k < group.count; k++) data[k] = values[first + k] ? (values[first + k] - 1) / 65534 : -1;
    } else data.fill(-1);
    group.attributes.value.needsUpdate = true;
  }

  showField(index) {
    this.field = index;
    const field = this.scene.fields[index];
    const stops = page.scales[field.scale].map((colour) => channels(colour).map((one) => one / 255));
    while (stops.length < 10) stops.push(stops[stops.length - 1]);
    for (const group of this.groups) {
      group.uniforms.uStops.value = stops;
      group.uniforms.uCount.value = page.scales[field.scale].length;
      this.fill(group);
    }
    this.legend.replaceChildren(...legendOf(field));
    this.tellAgain();
    this.wake();
  }

  /** Bring the bodies whose names end with `@joint` to the front; none for "". */
  showPart(joint) {
    const solder = this.groups.find((group) => group.name === "solder");
    const part = joint === "" ? -1 : this.scene.parts.findIndex((name) => name === `solder@${joint}`);
    if (!solder || (joint !== "" && part < 0)) return false;
    this.look(this.hasContext);
    if (part >= 0) {
      this.chosen = part;
      const parts = solder.attributes.part.data;
      const own = [...parts.keys()].filter((k) => parts[k] === part);
      const range = [0, 1, 2].map((axis) => own.map((k) => solder.points[3 * k + axis]));
      const middle = range.map((values) => 0.5 * (Math.min(...values) + Math.max(...values)));
      const size = Math.max(...range.map((values) => Math.max(...values) - Math.min(...values)));
      this.lookAt(middle, 5.5 * size);
      this.showTip(part, 12, 12);
    }
    this.wake();
    return true;
  }

  lookAt([x, y, z], distance) {
    const [a, b, c] = this.scene.view, length = Math.hypot(a, b, c);
    this.orbit.maxDistance = 4 * distance;
    this.orbit.target.set(x, z, -y);
    this.camera.position.set(x + (a / length) * distance, z + (c / length) * distance, -y - (b / length) * distance);
    this.orbit.forcePosition();
    this.wake();
  }

  /** Look at what matters, the rest as one sees through it; or at the whole, all of it solid. */
  look(solid) {
    for (const group of this.groups) if (group.ghost && group.state !== 2) group.state = solid ? 1 : 0;
    this.toggles.forEach((one) => one.update());
    this.frameOn(solid);
    this.drift = this.meanMotion();
    this.setFactor(solid ? this.scene.exaggeration : this.wholeFactor());
    this.reset();
  }

  setFactor(factor) {
    this.factor = factor;
    if (this.factorChanged) this.factorChanged();
    this.wake();
  }

  /** Return how many times as large displacements are drawn where everything is seen: by 1, 2 or 5 times ten to a power. */
  wholeFactor() {
    const largest = Math.max(...this.groups.map((group) => 32767 * group.scale));
    const wanted = (0.12 * 2 * this.radius) / (largest || Infinity);
    const power = 10 ** Math.floor(Math.log10(wanted || 1));
    const factor = Math.max(...[1, 2, 5].map((step) => step * power).filter((one) => one <= wanted), 1);
    return this.hasContext ? Math.min(factor, this.scene.exaggeration) : this.scene.exaggeration;
  }

  reset() {
    this.chosen = -1;
    this.tip.hidden = true;
    this.lookAt(this.middle, this.fitting());
  }

  /** Return the distance from which everything is seen, along the direction of the view. */
  fitting() {
    const [a, b, c] = this.scene.view, length = Math.hypot(a, b, c);
    const eye = [a / length, b / length, c / length], flat = Math.hypot(a, b);
    const right = [-eye[1] * (length / flat), eye[0] * (length / flat), 0];
    const up = [-eye[2] * right[1], eye[2] * right[0], flat / length];
    const reach = (axis) => 0.5 * this.extent.reduce((sum, one, k) => sum + Math.abs(one * axis[k]), 0);
    const half = Math.tan((15 * Math.PI) / 180), aspect = Math.max((this.canvasBox.clientWidth || 900) / VIEW_HEIGHT, 0.5);
    return 1.06 * Math.max(reach(up) / half, reach(right) / (half * 0.86 * aspect)) + reach(eye);
  }

  listen() {
    const { canvas } = this.gl;
    // The page scrolls under the wheel until the view has been clicked.
    this.canvasBox.addEventListener("wheel", (event) => document.activeElement !== canvas && event.stopPropagation(), true);
    canvas.addEventListener("mousedown", (event) => {
      this.pressed = [event.clientX, event.clientY];
      canvas.focus({ preventScroll: true });
    });
    canvas.addEventListener("click", (event) => this.clicked(event));
    for (const name of ["mousemove", "wheel", "touchmove", "mousedown"]) addEventListener(name, () => this.wake(2), { passive: true });
    new ResizeObserver(() => this.resize()).observe(this.canvasBox);
  }

  clicked(event) {
    if (Math.hypot(event.clientX - this.pressed[0], event.clientY - this.pressed[1]) > 4) return;
    const box = this.gl.canvas.getBoundingClientRect();
    const [x, y] = [event.clientX - box.left, event.clientY - box.top];
    this.showTip(this.pick(x, y), x, y);
  }

  tellAgain() {
    if (!this.tip.hidden) this.showTip(...this.tipArguments);
  }

  /** Name a body, and say the largest value that it has now. */
  showTip(part, x, y) {
    this.tipArguments = [part, x, y];
    this.tip.hidden = part < 0;
    if (part < 0) return;
    const field = this.scene.fields[this.field];
    let most = -1;
    for (const group of this.groups) {
      const parts = group.attributes.part.data, values = group.attributes.value.data;
      for (let k = 0; k < group.count; k++) if (parts[k] === part) most = Math.max(most, values[k]);
    }
    const top = field && most >= 0 ? `: at most ${most >= 1 ? "≥ " : ""}${shortNumber(field.low + most * (field.high - field.low))} ${field.unit}` : "";
    this.tip.textContent = this.scene.parts[part] + top;
    this.tip.style.left = `${x + 10}px`;
    this.tip.style.top = `${y + 10}px`;
  }

  /** Return the number of the body at a place of the canvas; -1 where there is none. */
  pick(x, y) {
    const gl = this.gl;
    const [width, height] = [gl.canvas.clientWidth, gl.canvas.clientHeight];
    const target = new ogl.RenderTarget(gl, { width, height, minFilter: gl.NEAREST });
    this.setUniforms(1);
    gl.clearColor(0, 0, 0, 0);
    this.renderer.render({ scene: this.root, camera: this.camera, target });
    const pixel = new Uint8Array(4);
    this.renderer.bindFramebuffer(target);
    gl.readPixels(x, height - y, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    this.renderer.bindFramebuffer();
    gl.clearColor(1, 1, 1, 1);
    this.wake();
    return pixel[0] + 256 * pixel[1] - 1;
  }

  wake(frames = 1) {
    const asleep = this.dirty <= 0;
    this.dirty = Math.max(this.dirty, frames);
    if (asleep && this.orbit) requestAnimationFrame(() => this.draw());
  }

  draw() {
    this.dirty -= 1;
    this.orbit.update();
    const distance = this.camera.position.distance(this.orbit.target);
    this.camera.perspective({ near: Math.max(0.05 * distance, 1e-3 * this.radius), far: distance + 6 * this.radius, aspect: this.aspect });
    const [x, y, z] = this.drift.map((one) => (this.follows ? this.factor * one : 0));
    this.root.position.set(-x, -z, y);
    this.setUniforms(0);
    this.renderer.render({ scene: this.root, camera: this.camera, sort: false });
    this.placeLabels();
    if (this.dirty > 0) requestAnimationFrame(() => this.draw());
  }

  setUniforms(picking) {
    // See-through bodies are drawn last and hide nothing.
    this.root.children.sort((a, b) => order(this.groups, a) - order(this.groups, b));
    for (const group of this.groups) {
      const ghost = group.state === 1;
      const shown = group.state !== 2 && !(picking && ghost) && (group.only === null || group.only === this.frame);
      group.uniforms.uPicking.value = picking;
      group.uniforms.uFactor.value = this.factor;
      group.uniforms.uAlpha.value = ghost ? GHOST : 1;
      group.uniforms.uChosen.value = this.chosen >= 0 && group.name === "solder" ? this.chosen : -1;
      group.uniforms.uSize.value = group.size * this.gl.canvas.height * 0.5;
      for (const mesh of group.meshes) {
        mesh.visible = shown && (mesh !== group.edges || (this.meshed && !picking && !ghost));
      }
    }
  }

  placeLabels() {
    this.scene.labels.forEach(({ at: [x, y, z] }, k) => {
      const place = new ogl.Vec3(x, z, -y);
      this.camera.project(place);
      this.labels[k].style.left = `${(0.5 + 0.5 * place.x) * this.gl.canvas.clientWidth}px`;
      this.labels[k].style.top = `${(0.5 - 0.5 * place.y) * this.gl.canvas.clientHeight}px`;
    });
  }

  resize() {
    const width = widthOf(this.canvasBox);
    if (width !== this.width) this.renderer.setSize(width, VIEW_HEIGHT);
    this.width = width;
    this.aspect = width / VIEW_HEIGHT;
    this.wake();
  }
}

function widthOf(place) {
  return Math.max(place.clientWidth || shownWidth(place), 100);
}
