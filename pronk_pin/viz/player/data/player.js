"use strict";
// Plays films of a robot, see scene_encoding.py for what is in them. One clock drives robots, forces,
// trails and plots; nothing is drawn that the data does not hold.

const {THREE} = MeshCat;
const GHOST_OPACITY = 0.35, TRAIL_SECONDS = 0.7, TILE = 0.5, LEAST_FORCE = 2.0;
const STEEL = 7850;  // kg/m^3
const PAYLOAD_COLOR = 0x8a4f7d, FIRM = 0xffffff, SOFT = 0xc9a878;
const FORCE_COLOR = 0xd55e00, CONE_COLOR = 0x009e73, TRAIL_COLOR = 0x444444;
const VIEWS = {reset: [0.55, 0.45, 0.85], side: [0, 0.25, 1.15], front: [1.3, 0.35, 0.001],
               top: [0, 1.5, 0.001]};
const short = (name) => name.split(" [")[0];  // an option without its unit, in the address
const $ = (id) => document.getElementById(id);

// --- blobs: see packing.py ------------------------------------------------------------------

async function unpack(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const buffer = await new Response(stream).arrayBuffer();
  const length = new DataView(buffer).getUint32(0, true);
  const data = new Uint8Array(buffer, 4 + length);
  const text = new TextDecoder().decode(new Uint8Array(buffer, 4, length));
  return JSON.parse(text, (key, value) => (value && value.$ ? decode(value, data) : value));
}

function decode(entry, data) {
  const count = entry.shape.reduce((a, b) => a * b, 1);
  if (entry.$ === "u4") {
    return new Uint32Array(data.slice(entry.at, entry.at + 4 * count).buffer);
  }
  const rows = entry.shape[0], columns = entry.low.length, values = new Float32Array(count);
  for (let c = 0, k = entry.at; c < columns; c++) {
    for (let r = 0, sum = 0; r < rows; r++, k++) {
      sum = (sum + data[k] + 256 * data[k + count]) & 0xffff;
      values[r * columns + c] = sum === 0xffff ? NaN : entry.low[c] + entry.step[c] * sum;
    }
  }
  return {values, rows, columns};
}

// --- the robot ------------------------------------------------------------------------------

const SOLIDS = {
  box: (x, y, z) => new THREE.BoxGeometry(x, y, z),
  sphere: (radius) => new THREE.SphereGeometry(radius, 16, 8),
  cylinder: (radius, length) =>
    new THREE.CylinderGeometry(radius, radius, length, 16).rotateX(Math.PI / 2),  // along z
  cone: (radius, length) => new THREE.ConeGeometry(radius, length, 16).rotateX(Math.PI / 2),
  capsule(radius, length) {
    const bow = Array.from({length: 9}, (_, i) => Math.PI / 16 * i);  // from a pole to the side
    const side = bow.map((angle) => new THREE.Vector2(
      radius * Math.sin(angle), radius * Math.cos(angle) + length / 2));
    const outline = [...side, ...side.slice().reverse().map(({x, y}) => new THREE.Vector2(x, -y))];
    return new THREE.LatheGeometry(outline.reverse(), 16).rotateX(Math.PI / 2);
  },
};

function geometryOf(shape) {
  if (shape.kind) return SOLIDS[shape.kind](...shape.size);
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(shape.vertices.values, 3));
  geometry.setIndex(new THREE.BufferAttribute(shape.faces, 1));
  geometry.computeVertexNormals();
  return geometry;
}

function fixed(object, placement) {
  new THREE.Matrix4().fromArray(placement).decompose(
    object.position, object.quaternion, object.scale);
  return object;
}

const ARROW = (() => {
  const profile = [[0, 0], [0.008, 0], [0.008, 0.75], [0.02, 0.75], [0, 1]];
  const lathe = new THREE.LatheGeometry(profile.map(([r, z]) => new THREE.Vector2(r, z)), 16);
  return lathe.rotateX(Math.PI / 2);  // along z
})();

// One track on the screen: a tree of joints with the parts on it, arrows, cones and trails.
class Figure {
  constructor(robot, track, film, world) {
    this.robot = robot; this.track = track; this.film = film;
    this.group = new THREE.Group();
    world.add(this.group);
    this.parts = [];
    this.nodes = [null, new THREE.Group()];
    this.group.add(this.nodes[1]);
    for (const joint of robot.joints) {
      const node = fixed(new THREE.Group(), joint.placement);
      node.rest = node.quaternion.clone();
      node.place = node.position.clone();
      node.axis = new THREE.Vector3(...joint.axis);
      (this.nodes[joint.parent] || this.group).add(node);
      this.nodes.push(node);
    }
    for (const part of robot.parts) this.addPart(part);
    if (film.payload && !track.ghost) this.nodes[1].add(payloadMesh(film));
    this.arrows = this.perLeg("forces", () => {
      const arrow = new THREE.Mesh(ARROW, new THREE.MeshLambertMaterial({color: FORCE_COLOR}));
      arrow.castShadow = true;
      return arrow;
    });
    this.cones = film.friction ? this.perLeg("forces", () => coneMesh(film.friction)) : [];
    this.trails = track.ghost ? [] : robot.legs.map(() => this.addTrail());
  }

  addPart(part) {
    const ghost = this.track.ghost;
    const color = this.track.color || part.color;
    // Lit by vertices: without a graphics card a third of the work that lighting pixels is.
    const material = new THREE.MeshLambertMaterial({
      color, transparent: ghost, opacity: ghost ? GHOST_OPACITY : 1,
      // Where a ghost and the robot coincide the robot is in front, without speckles.
      polygonOffset: ghost, polygonOffsetFactor: 2, polygonOffsetUnits: 2,
    });
    const mesh = fixed(new THREE.Mesh(this.robot.geometries[part.shape], material), part.placement);
    mesh.castShadow = !ghost;
    mesh.receiveShadow = false;
    mesh.name = part.name;
    (this.nodes[part.joint] || this.group).add(mesh);
    this.parts.push({mesh, joint: part.joint - 2, plain: new THREE.Color(material.color)});
  }

  perLeg(channel, make) {
    if (!this.track.channels.includes(channel)) return [];
    return this.robot.legs.map(() => {
      const object = make();
      this.group.add(object);
      return object;
    });
  }

  addTrail() {
    const geometry = new THREE.BufferGeometry();
    const {values: times} = this.film.times, last = times[times.length - 1] || 1;
    const size = Math.max(44, Math.ceil(1.5 * TRAIL_SECONDS * times.length / last) + 8);
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(3 * size), 3));
    const color = this.track.color || TRAIL_COLOR;
    const line = new THREE.Line(geometry, new THREE.LineBasicMaterial({color}));
    line.frustumCulled = false;
    this.group.add(line);
    return line;
  }

  // Show one instant: row holds q, feet and the channels; past the feet of the last moments.
  show(row, past) {
    const base = this.nodes[1], q = row.q;
    base.position.set(q[0], q[1], q[2]);
    base.quaternion.set(q[3], q[4], q[5], q[6]).normalize();
    const turn = new THREE.Quaternion(), way = new THREE.Vector3();
    this.robot.joints.forEach((joint, i) => {
      const node = this.nodes[i + 2];
      if (joint.slides) {
        way.copy(node.axis).applyQuaternion(node.rest);
        node.position.copy(node.place).addScaledVector(way, q[7 + i]);
        return;
      }
      node.quaternion.copy(node.rest).multiply(turn.setFromAxisAngle(node.axis, q[7 + i]));
    });
    const visible = !this.track.ghost || $("ghosts").checked;
    this.group.visible = visible;
    this.showForces(row);
    this.trails.forEach((line, leg) => {
      line.visible = $("trails").checked;
      const position = line.geometry.attributes.position;
      const count = Math.min(past.length, position.count);
      for (let i = 0; i < count; i++) {
        const feet = past[past.length - count + i];
        position.setXYZ(i, feet[3 * leg], feet[3 * leg + 1],
                        feet[3 * leg + 2] - this.robot.footRadius + 0.003);
      }
      position.needsUpdate = true;
      line.geometry.setDrawRange(0, count);
    });
    this.paint(row);
  }

  showForces(row) {
    const up = new THREE.Vector3(0, 0, 1), force = new THREE.Vector3();
    this.robot.legs.forEach((leg, i) => {
      if (!row.forces) return;
      force.fromArray(row.forces, 3 * i);
      const size = force.length(), acts = size > LEAST_FORCE;  // false for NaN too
      for (const [objects, box] of [[this.arrows, "arrows"], [this.cones, "cones"]]) {
        if (!objects.length) continue;
        objects[i].visible = acts && $(box).checked;
        objects[i].position.fromArray(row.feet, 3 * i);
        objects[i].position.z -= this.robot.footRadius;
      }
      if (acts) {
        const arrow = this.arrows[i];
        arrow.scale.set(1, 1, this.film.forceScale * size);
        arrow.quaternion.setFromUnitVectors(up, force.divideScalar(size));
      }
    });
  }

  // Colour the parts by what their joint does.
  paint(row) {
    const by = this.track.ghost ? "" : $("colour").value, values = row[by];
    const end = by === "torque" ? this.film.useScale : this.film.errorScale;
    for (const {mesh, joint, plain} of this.parts) {
      let value = values && joint >= 0 ? Math.abs(values[joint]) / end : NaN;
      if (by === "torque") value /= this.robot.torqueLimits[joint];
      const color = Number.isNaN(value) ? null
        : this.robot.scale[Math.min(31, Math.floor(32 * value))];
      if (color) mesh.material.color.set(color); else mesh.material.color.copy(plain);
    }
  }

  remove() {
    this.group.parent.remove(this.group);
    this.nodes[1].children.forEach((child) => child.name === "payload" && child.geometry.dispose());
    this.parts.forEach(({mesh}) => mesh.material.dispose());
    this.trails.forEach((line) => line.geometry.dispose());
  }
}

function payloadMesh(film) {
  const side = Math.cbrt(film.payload / STEEL);
  const material = new THREE.MeshLambertMaterial({color: PAYLOAD_COLOR});
  const mesh = new THREE.Mesh(new THREE.BoxGeometry(side, side, side), material);
  mesh.position.fromArray(film.payloadPosition);
  mesh.castShadow = true;
  mesh.name = "payload";
  return mesh;
}

function coneMesh(friction) {
  const height = 0.1;
  const geometry = new THREE.ConeGeometry(friction * height, height, 32, 1, true);
  geometry.translate(0, -height / 2, 0).rotateX(-Math.PI / 2);  // its tip at 0, opening along z
  return new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({
    color: CONE_COLOR, transparent: true, opacity: 0.25, side: THREE.DoubleSide,
    depthWrite: false,
  }));
}

// --- surroundings ---------------------------------------------------------------------------

function groundMesh() {
  const tiles = 28, colors = [0xebebe8, 0xc2c4c9].map((c) => new THREE.Color(c));
  const geometry = new THREE.PlaneGeometry(tiles * TILE, tiles * TILE, tiles, tiles).toNonIndexed();
  const paint = new Float32Array(3 * geometry.attributes.position.count);
  for (let i = 0; i < tiles * tiles * 6; i++) {
    const tile = Math.floor(i / 6), odd = (tile % tiles + Math.floor(tile / tiles)) % 2;
    colors[odd].toArray(paint, 3 * i);
  }
  geometry.setAttribute("color", new THREE.BufferAttribute(paint, 3));
  const ground = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({vertexColors: true}));
  ground.receiveShadow = true;
  return ground;
}

function surroundings(viewer) {
  for (const path of ["/Grid", "/Axes", "/Lights/PointLightNegativeX",
                      "/Lights/PointLightPositiveX"]) {
    viewer.set_property(path.split("/").slice(1), "visible", false);
  }
  viewer.set_property(["Background"], "top_color", [0.86, 0.90, 0.94]);
  viewer.set_property(["Background"], "bottom_color", [0.97, 0.97, 0.96]);
  viewer.set_property(["Lights", "AmbientLight", "<object>"], "intensity", 0.4);
  viewer.set_property(["Lights", "FillLight", "<object>"], "intensity", 0.3);
  // A sun that throws shadows: what tells a robot in the air from one on the ground.
  const sun = new THREE.DirectionalLight(0xffffff, 0.5);
  sun.position.set(0.6, -1.2, 3.0);
  sun.castShadow = true;
  sun.shadow.mapSize.set(2048, 2048);
  sun.shadow.bias = -0.001;
  Object.assign(sun.shadow.camera, {left: -1.8, right: 1.8, top: 1.8, bottom: -1.8, near: 0.5,
                                    far: 8.0});
  viewer.scene.add(sun);
}

// --- plots ----------------------------------------------------------------------------------

// What each plot shows of a track: curves of a joint, the first solid and the second dashed.
const PLOTS = {
  angle: (track, joints) => track.error && [
    (r, j) => track.q.values[r * track.q.columns + 7 + j],
    (r, j) => track.q.values[r * track.q.columns + 7 + j] + track.error.values[r * joints + j],
  ],
  error: (track, joints) => track.error && [(r, j) => track.error.values[r * joints + j]],
  torque: (track, joints) => track.torque && [
    (r, j) => track.torque.values[r * joints + j],
    ...(track.feedforward ? [(r, j) => track.feedforward.values[r * joints + j]] : []),
  ],
};

const colorOf = (track) => track.accent || track.color;
const hasForces = (track) =>
  track.channels.includes("forces") && track.forces.values.some((value) => !Number.isNaN(value));

// A robot's errors in a stride, in words.
function errorsOf(track, stride) {
  const {history} = track, at = history ? history.stride.indexOf(stride) : -1;
  if (at < 0) return "";
  const words = Object.entries(history.errors).map(([joint, errors]) =>
    `${joint} ${errors[at] === null ? "-" : Math.round(1000 * errors[at])}`);
  return `: ${words.join(", ")} mrad`;
}

class Plot {
  constructor(name, player) {
    this.name = name; this.player = player;
    this.canvas = $(`${name}-plot`);
    this.picture = document.createElement("canvas");
    this.canvas.addEventListener("pointerdown", (event) => this.seek(event));
    this.canvas.addEventListener("pointermove", (event) => {
      if (event.buttons) this.seek(event); else this.tell(this.timeAt(event));
    });
    this.canvas.addEventListener("pointerleave", () => this.tell(NaN));
  }

  timeAt(event) {
    const {duration} = this.player, width = this.canvas.clientWidth;
    return Math.min(Math.max(duration * (event.offsetX - 40) / (width - 46), 0), duration);
  }

  seek(event) { this.player.seek(this.timeAt(event)); }

  get tracks() {
    const {film, robot} = this.player;
    return film.tracks.filter((track) => !track.ghost)
      .map((track) => [track, PLOTS[this.name](track, robot.jointNames.length)])
      .filter(([, curves]) => curves);
  }

  // The values under the pointer, after the name of the plot.
  tell(time) {
    const joint = Number($("joint").value), words = $(`${this.name}-value`);
    this.hover = time;
    if (Number.isNaN(time) || !this.player.film) { words.textContent = ""; return; }
    const row = Math.round(this.player.frameAt(time));
    const values = this.tracks.map(([, curves]) =>
      curves.map((curve) => Number(curve(row, joint).toPrecision(3))).join(" / "));
    words.textContent = `${time.toFixed(2)} s: ${values.join("; ")}`;
    this.player.dirty = true;
  }

  // Draw the curves, which stay; `mark` draws the line that moves.
  draw() {
    const {film, duration} = this.player, joint = Number($("joint").value);
    const tracks = this.tracks, {values: times} = film.times;
    for (const id of ["plot", "name"]) $(`${this.name}-${id}`).hidden = !tracks.length;
    const ratio = window.devicePixelRatio, width = this.canvas.clientWidth;
    const height = this.canvas.clientHeight;
    if (!tracks.length || !width) return;
    for (const canvas of [this.canvas, this.picture]) {
      canvas.width = width * ratio; canvas.height = height * ratio;
    }
    let low = this.name === "angle" ? Infinity : 0, high = this.name === "angle" ? -Infinity : 0;
    for (const [, curves] of tracks) {
      for (const curve of curves) {
        for (let r = 0; r < times.length; r++) {
          const value = curve(r, joint);
          if (value < low) low = value;
          if (value > high) high = value;
        }
      }
    }
    if (!Number.isFinite(low)) { low = 0; high = 1; }
    const step = niceStep((high - low) / 4 || 1);
    low = Math.floor(low / step) * step; high = Math.ceil(high / step) * step;
    if (high <= low) high = low + step;
    const x = (t) => 40 + (width - 46) * t / duration;
    const y = (v) => 6 + (height - 26) * (high - v) / (high - low);
    const pen = this.picture.getContext("2d");
    pen.scale(ratio, ratio);
    this.shade(pen, x, height);
    pen.font = "11px system-ui, sans-serif"; pen.fillStyle = "#555"; pen.strokeStyle = "#ddd";
    pen.textAlign = "right"; pen.textBaseline = "middle";
    for (let v = low; v < high + step / 2; v += step) {
      pen.fillText(String(Number((step * Math.round(v / step)).toPrecision(3))), 36, y(v));
      line(pen, [[40, y(v)], [width - 6, y(v)]]);
    }
    pen.textAlign = "center";
    const every = niceStep(duration / 4 || 1);
    for (let t = 0; t <= duration; t += every) {
      pen.fillText(`${Number(t.toPrecision(3))} s`, x(t), height - 8);
    }
    for (const [track, curves] of [...tracks].reverse()) {  // the leader's over all others
      pen.strokeStyle = colorOf(track) || "#222";
      curves.forEach((curve, k) => {
        pen.lineWidth = k ? 1 : 1.4;
        pen.setLineDash(k ? [3, 2] : []);
        line(pen, Array.from(times, (t, r) => [x(t), y(curve(r, joint))]));
      });
    }
    pen.setLineDash([]);
    this.x = x;
  }

  // Grey while the leader stands, and a line where its learning begins.
  shade(pen, x, height) {
    const {leader, film, duration, began} = this.player;
    pen.fillStyle = "#eceef0";
    leader.marks.forEach(([t, , phase], k) => {
      const next = leader.marks[k + 1], end = next ? next[0] - film.start : duration;
      if (phase !== "stance") return;
      pen.fillRect(x(t - film.start), 6, x(Math.min(end, duration)) - x(t - film.start), height - 26);
    });
    if (!(began > 0)) return;
    pen.strokeStyle = "#d55e00"; pen.lineWidth = 1.5;
    line(pen, [[x(began), 0], [x(began), height - 20]]);
  }

  mark(time) {
    const pen = this.canvas.getContext("2d"), {width, height} = this.canvas;
    if (!this.x || !width) return;
    pen.clearRect(0, 0, width, height);
    pen.drawImage(this.picture, 0, 0);
    pen.strokeStyle = "#0072b2"; pen.lineWidth = 1.5 * window.devicePixelRatio;
    const x = this.x(time) * window.devicePixelRatio;
    line(pen, [[x, 0], [x, height - 20 * window.devicePixelRatio]]);
  }
}

// Errors of all strides of the run, of which the film shows some: a click jumps to a stride.
class Timeline {
  constructor(player) { this.player = player; this.canvas = $("timeline"); }

  get histories() {
    const {film} = this.player;
    return film ? film.tracks.filter((track) => track.history && !track.ghost) : [];
  }

  draw() {
    const tracks = this.histories, {canvas} = this;
    canvas.parentElement.hidden = !tracks.length;
    const width = canvas.clientWidth, height = canvas.clientHeight, ratio = window.devicePixelRatio;
    this.x = null;
    if (!tracks.length || !width) return;
    this.count = Math.max(...tracks.map(({history}) => history.stride.at(-1))) + 1;
    canvas.width = width * ratio; canvas.height = height * ratio;
    this.x = (stride) => width * stride / this.count;
    this.mark();
  }

  mark() {
    if (!this.x) return;
    const {player, canvas} = this, tracks = this.histories, {leader} = player;
    const ratio = window.devicePixelRatio, height = canvas.clientHeight, pen = canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, canvas.clientWidth, height);
    const numbers = leader.marks.map((entry) => entry[1]);
    pen.fillStyle = "#dfe9f2";  // what the film shows
    pen.fillRect(this.x(numbers[0]), 0, this.x(numbers.at(-1) + 1) - this.x(numbers[0]), height);
    const peaks = tracks.map(({history}) => Object.values(history.errors)[0]);
    const high = Math.max(...peaks.flat().map((value) => value || 0)) || 1;
    [...tracks].reverse().forEach((track) => {
      const errors = Object.values(track.history.errors)[0];
      pen.strokeStyle = colorOf(track) || "#222"; pen.lineWidth = 1.2;
      line(pen, track.history.stride.map((k, i) => [
        this.x(k + 0.5), errors[i] === null ? NaN : height - 2 - (height - 4) * errors[i] / high]));
    });
    const {began} = leader.history || {};
    if (began !== null && began !== undefined) {
      pen.strokeStyle = pen.fillStyle = "#d55e00"; pen.lineWidth = 1.5;
      line(pen, [[this.x(began), 0], [this.x(began), height]]);
      pen.font = "11px system-ui, sans-serif"; pen.textBaseline = "top";
      pen.fillText("learning on", this.x(began) + 4, 1);
    }
    const now = player.markOf(leader);
    if (!now) return;
    pen.strokeStyle = "#0072b2"; pen.lineWidth = 1.5;
    line(pen, [[this.x(now[1] + 0.5), 0], [this.x(now[1] + 0.5), height]]);
  }

  strideAt(event) {
    const at = Math.floor(this.count * event.offsetX / this.canvas.clientWidth);
    return Math.min(Math.max(at, 0), this.count - 1);
  }

  tell(event) {
    if (!this.x) return;
    const k = this.strideAt(event);
    this.canvas.title = [`stride ${k}`, ...this.histories.map((track) =>
      track.name + errorsOf(track, k))].join("\n");
  }

  // To a stride: within the film, or in the strides that the menu has for it.
  async jump(event) {
    const {player} = this, k = this.strideAt(event), shows = () =>
      player.leader.marks.find((entry) => entry[1] === k);
    if (!shows()) await player.strides(k);
    const mark = shows();
    if (mark) player.seek(mark[0] - player.film.start);
    else $("state").textContent = `Stride ${k} is not in this file: pronk-pin view shows it.`;
  }
}

function line(pen, points) {
  pen.beginPath();
  let drawing = false;
  for (const [x, y] of points) {
    if (Number.isNaN(y)) { drawing = false; continue; }
    if (drawing) pen.lineTo(x, y); else pen.moveTo(x, y);
    drawing = true;
  }
  pen.stroke();
}

function niceStep(rough) {
  const unit = 10 ** Math.floor(Math.log10(rough));
  return unit * [1, 2, 5, 10].find((k) => k * unit >= rough);
}

// --- the player -----------------------------------------------------------------------------

class Player {
  // source: robot (bytes), options, first, film(choice): a promise of bytes.
  static async start(source) {
    const player = new Player(source);
    const robot = await unpack(source.robot);
    robot.geometries = robot.shapes.map(geometryOf);
    player.robot = robot;
    robot.jointNames.forEach((name, i) => $("joint").add(new Option(name, i)));
    $("joint").value = robot.shown;
    await player.obey();
    player.tick(performance.now());
    return player;
  }

  constructor(source) {
    this.source = source;
    this.viewer = new MeshCat.Viewer($("pane"), false);
    this.viewer.gui.domElement.style.display = "none";
    this.viewer.set_3d_pane_size = () => this.fit();
    surroundings(this.viewer);
    this.ground = groundMesh();
    this.world = new THREE.Group();
    this.earth = new THREE.Group();  // leans with the slope
    this.earth.add(this.ground, this.world);
    this.viewer.scene.add(this.earth);
    const {controls} = this.viewer;
    Object.assign(controls, {maxPolarAngle: 0.49 * Math.PI, minDistance: 0.15, maxDistance: 12});
    controls.addEventListener("start", () => { this.moved = true; });
    this.following = true;
    this.figures = []; this.drawn = 0; this.time = 0; this.playing = true; this.ready = false;
    this.plots = Object.keys(PLOTS).map((name) => new Plot(name, this));
    this.timeline = new Timeline(this);
    this.controls();
  }

  fit() {
    const {clientWidth: width, clientHeight: height} = $("pane");
    this.viewer.camera.aspect = width / height;
    this.viewer.camera.updateProjectionMatrix();
    this.viewer.renderer.setSize(width, height);
    if (this.film) { this.plots.forEach((plot) => plot.draw()); this.timeline.draw(); }
    this.dirty = true;
  }

  controls() {
    for (const [name, values] of Object.entries(this.source.options)) {
      const label = document.createElement("label"), select = document.createElement("select");
      label.innerHTML = "<span></span>";
      label.firstChild.textContent = name;
      select.id = `option-${name.replaceAll(" ", "-")}`;
      values.forEach((value) => select.add(new Option(value, value)));
      select.value = this.source.first[name];
      select.dataset.option = name;
      select.addEventListener("change", () => this.load(name));
      label.append(select);
      label.hidden = values.length < 2;
      $("options").append(label);
    }
    $("play").addEventListener("click", () => this.playing ? this.pause() : this.play());
    $("scrub").addEventListener("input", () => { this.pause(); this.seek(+$("scrub").value); });
    $("stride").addEventListener("change", () => this.seek(+$("stride").value));
    $("joint").addEventListener("change", () => { this.fit(); });
    for (const id of ["ghosts", "arrows", "trails", "cones", "colour"]) {
      $(id).addEventListener("change", () => { this.legend(); this.dirty = true; });
    }
    document.addEventListener("keydown", (event) => {
      this.key(event);
    });
    // What was clicked keeps no focus: space plays, and arrows step, as before the click.
    document.addEventListener("click", ({target, detail}) => {
      if (detail && target.matches("input, button")) target.blur();
    });
    document.querySelectorAll("[data-view]").forEach((button) => {
      button.addEventListener("click", () => this.look(button.dataset.view));
    });
    for (const kind of ["pointerdown", "mousedown", "touchstart"]) {  // not for turning the view
      $("views").addEventListener(kind, (event) => event.stopPropagation());
    }
    $("follow").addEventListener("click", () => this.follow(!this.following));
    $("full").addEventListener("click", () => document.fullscreenElement
      ? document.exitFullscreen() : document.documentElement.requestFullscreen());
    $("snap").addEventListener("click", () => this.snap());
    $("drawer").addEventListener("click", () => {
      const open = document.body.classList.toggle("open");
      $("drawer").setAttribute("aria-expanded", open);
      this.plots.forEach((plot) => plot.draw());  // they had no size
      this.dirty = true;
    });
    $("timeline").addEventListener("click", (event) => this.timeline.jump(event));
    $("timeline").addEventListener("pointermove", (event) => this.timeline.tell(event));
    window.addEventListener("resize", () => { if (!this.moved && this.film) this.look(); this.fit(); });
    window.addEventListener("hashchange", () => this.obey());
    this.viewer.controls.addEventListener("change", () => { this.dirty = true; });
    this.viewer.controls.addEventListener("end", () => this.remember());
    for (const id of ["rate", "joint", "colour"]) {
      $(id).addEventListener("change", () => this.remember());
    }
  }

  key(event) {
    const {key} = event, target = event.target.matches ? event.target : document.body, still = target.matches("select, input[type=text]");
    if (still || event.ctrlKey || event.metaKey || event.altKey) return;
    if (key === " " && target.matches("button, input[type=checkbox]")) return;  // theirs
    const step = {ArrowLeft: -0.01, ArrowRight: 0.01}[key];
    const view = {r: "reset", s: "side", f: "front", t: "top"}[key];
    if (key === " ") $("play").click();
    else if (step) { this.pause(); this.seek(this.time + step); }
    else if (view) this.look(view);
    else if (key === "c") this.follow(!this.following);
    else if (key === "p") this.snap();
    else return;
    event.preventDefault();
  }

  // A picture of this view, as a file.
  snap() {
    this.viewer.render();
    const link = document.createElement("a");
    link.href = this.viewer.renderer.domElement.toDataURL("image/png");
    link.download = `${document.title.replace(/[^a-z0-9.]+/gi, "-")}-${this.time.toFixed(2)}s.png`;
    link.click();
  }

  follow(following) {
    this.following = following;
    $("follow").setAttribute("aria-pressed", following);
    this.dirty = true;
  }

  // The whole choice in the address, so that a reload or a copied link shows the same.
  remember() {
    if (!this.film) return;
    const words = new URLSearchParams();
    for (const [name, value] of Object.entries(this.shown)) words.set(short(name), value);
    if (!this.playing) words.set("t", this.time.toFixed(3));
    if ($("rate").value !== "1") words.set("rate", $("rate").value);
    if ($("colour").value) words.set("colour", $("colour").value);
    if (+$("joint").value !== this.robot.shown) words.set("joint", $("joint").value);
    if (this.moved) {
      const {camera, controls} = this.viewer;
      const numbers = [...camera.position.toArray(), ...controls.target.toArray()];
      words.set("camera", numbers.map((x) => x.toFixed(3)).join(" "));
    }
    history.replaceState(null, "", `#${words}`);
  }

  // Show what the address says.
  async obey() {
    const words = new URLSearchParams(location.hash.slice(1));
    for (const select of this.selects) {
      const value = words.get(short(select.dataset.option));
      if (value !== null && [...select.options].some((option) => option.value === value)) {
        select.value = value;
      }
    }
    for (const [id, value] of [["rate", words.get("rate")], ["joint", words.get("joint")],
                               ["colour", words.get("colour")]]) {
      if (value !== null && [...$(id).options].some((option) => option.value === value)) {
        $(id).value = value;
      }
    }
    const camera = (words.get("camera") || "").split(" ").map(Number);
    const stride = words.get("stride"), t = parseFloat(words.get("t"));
    await this.load();
    if (camera.length === 6 && camera.every(Number.isFinite)) {
      this.viewer.camera.position.fromArray(camera);
      this.viewer.controls.target.fromArray(camera, 3);
      this.moved = true;
    }
    if (!this.film) return;
    const mark = stride && this.leader.marks.find((entry) => String(entry[1]) === stride);
    if (mark) this.seek(mark[0] - this.film.start);
    if (Number.isFinite(t)) { this.pause(); this.seek(t); }
  }

  get selects() { return [...$("options").querySelectorAll("select")]; }

  get choice() {
    return Object.fromEntries(this.selects.map((s) => [s.dataset.option, s.value]));
  }

  set choice(choice) {
    for (const select of this.selects) select.value = choice[select.dataset.option];
  }

  // The nearest of the choices that there are to one that keeps the option changed last.
  held(choice, changed) {
    const {held} = this.source;
    if (!held) return choice;
    const names = Object.keys(choice);
    const alike = (values) => names.reduce((sum, name, i) =>
      sum + (values[i] === choice[name]) * (name === changed ? 100 : 1), 0);
    const best = held.reduce((a, b) => (alike(b) > alike(a) ? b : a));
    return Object.fromEntries(names.map((name, i) => [name, best[i]]));
  }

  // Load the film that the options choose; the clock runs on, so that films can be compared.
  async load(changed) {
    const order = this.loading = (this.loading || 0) + 1;
    const choice = this.choice = this.held(this.choice, changed);
    let film;
    try {
      film = await unpack(await this.source.film(choice));
    } catch (error) {
      if (order !== this.loading) return;
      $("state").textContent = error.message;
      if (this.shown) this.choice = this.shown;  // menus say what the picture shows
      return;
    }
    if (order !== this.loading) return;  // another was chosen meanwhile
    $("state").textContent = "";
    this.shown = choice;
    this.show(film);
    this.remember();
  }

  show(film) {
    this.figures.forEach((figure) => figure.remove());
    const before = this.film ? this.solid : 0;
    this.film = film;
    this.duration = film.times.values[film.times.rows - 1];
    this.figures = film.tracks.map((track) => new Figure(this.robot, track, film, this.world));
    document.title = $("title").textContent = film.title || "pronk_pin";
    $("caption").textContent = film.caption;
    const still = this.duration === 0;
    for (const id of ["play", "track", "clock", "rate"]) $(id).hidden = still;
    $("scrub").max = this.duration;
    this.fillStrides();
    for (const name of ["error", "torque"]) {
      const known = film[name === "error" ? "errorScale" : "useScale"] !== null;
      $("colour").querySelector(`[value=${name}]`).disabled = !known;
      if (!known && $("colour").value === name) $("colour").value = "";
    }
    const holds = (channel) => film.tracks.some((track) => track.channels.includes(channel));
    $("ghosts").parentElement.hidden = !film.tracks.some((track) => track.ghost);
    $("arrows").parentElement.hidden = !holds("forces");
    $("cones").parentElement.hidden = !holds("forces") || !film.friction;
    $("plots").hidden = !holds("error") && !holds("torque");
    this.earth.rotation.y = -film.slope;
    this.ground.material.color.set(film.soft ? SOFT : FIRM);
    this.learned();
    this.legend();
    this.timeline.draw();  // it takes room from the pane
    if (this.solid !== before) this.look();  // the rest of the time the camera is the reader's
    this.fit();
    this.seek(this.time);
  }

  // From the robots' right front; MeshCat's camera has y up. A narrow pane is seen from farther.
  look(view = "reset") {
    const {camera, controls} = this.viewer;
    const narrow = Math.max(1, 1.2 * $("pane").clientHeight / ($("pane").clientWidth || 1));
    const far = this.robot.size * (1 + 0.35 * Math.max(this.solid - 1, 0)) * narrow;
    const [x, y, z] = VIEWS[view];
    camera.position.set(x * far, y * far, z * far);
    camera.fov = 50;
    camera.updateProjectionMatrix();
    controls.target.set(0, 0.2 * this.robot.size, 0);
    this.moved = view !== "reset";
    this.dirty = true;
    if (this.ready) this.remember();
  }

  get solid() { return this.film.tracks.filter((track) => !track.ghost).length; }
  get leader() { return this.film.tracks.find((track) => !track.ghost) || this.film.tracks[0]; }

  // When the learning begins in this film [s]: NaN if it does not.
  get began() {
    const {history, marks} = this.leader;
    const mark = history && marks.find((entry) => entry[1] === history.began);
    return mark ? mark[0] - this.film.start : NaN;
  }

  learned() {
    const inside = this.began > 0;
    $("began").hidden = !inside;
    if (inside) $("began").style.left = `${100 * this.began / this.duration}%`;
  }

  fillStrides() {
    const strides = new Map();
    for (const [t, stride] of this.leader.marks) {
      if (!strides.has(stride)) strides.set(stride, t - this.film.start);
    }
    $("stride").replaceChildren(...[...strides].map(([k, t]) => new Option(k, t)));
    $("stride").parentElement.hidden = strides.size < 2;
  }

  legend() {
    const trunk = this.robot.parts.find((part) => part.joint === 1);
    const entry = (color, ...texts) => {
      const item = document.createElement("li");
      item.innerHTML = "<i></i><b></b><span></span><span></span>";
      item.firstChild.style.background = color;
      texts.forEach((text, i) => { item.children[i + 1].textContent = text; });
      return item;
    };
    this.words = new Map();  // of the tracks whose phase and stride are told
    const ghosts = this.film.tracks.filter((track) => track.ghost);
    const solid = this.film.tracks.filter((track) => !track.ghost);
    const items = (solid.length ? solid : ghosts).map((track) => {
      const item = entry(colorOf(track) || (trunk ? trunk.color : "#888"), track.name,
                         track.caption ? `: ${track.caption}` : "");
      this.words.set(track, item.children[3]);
      return item;
    });
    if (ghosts.length && solid.length) {
      items.push(entry(ghosts[0].color, ghosts.length > 1 ? "references" : ghosts[0].name,
                       ghosts.length === 1 && ghosts[0].caption ? `: ${ghosts[0].caption}` : ""));
    }
    if (this.film.tracks.some(hasForces)) {
      const newtons = Number((0.1 / this.film.forceScale).toPrecision(2));
      const mean = this.film.forceWindow
        ? `, mean over ${Math.round(1000 * this.film.forceWindow)} ms` : "";
      items.push(entry("#d55e00", "", `ground reaction force, 0.1 m for ${newtons} N${mean}`));
    }
    const silent = solid.filter((track) => !hasForces(track)).map((track) => track.name);
    if (silent.length && (this.film.forceWindow || silent.length < solid.length)) {
      const whose = silent.length < solid.length ? ` for ${silent.join(", ")}` : "";
      items.push(entry("transparent", "", `no forces and cones${whose}: not kept for these strides`));
    }
    if (this.film.payload) items.push(entry("#8a4f7d", "", `payload, ${this.film.payload} kg`));
    if (this.film.slope) {
      const percent = (100 * Math.tan(this.film.slope)).toFixed(1);
      items.push(entry("transparent", "", `ground slopes by ${percent} %`));
    }
    if (this.film.soft) items.push(entry("#c9a878", "", "soft ground"));
    $("tracks").replaceChildren(...items);
    this.drawScale();
  }

  drawScale() {
    const by = $("colour").value, bar = document.createElement("canvas");
    $("scale").hidden = !by;
    if (!by) return;
    bar.width = 32; bar.height = 1;
    this.robot.scale.forEach((color, i) => {
      const pen = bar.getContext("2d");
      pen.fillStyle = color; pen.fillRect(i, 0, 1, 1);
    });
    const end = by === "error" ? `${this.film.errorScale} rad`
      : `${Math.round(100 * this.film.useScale)} % of the torque limit`;
    $("scale").replaceChildren("0", bar, end);
  }

  colour(by) { $("colour").value = by; this.legend(); this.dirty = true; }
  play() { this.playing = true; this.remember(); $("play").textContent = "Pause"; }
  pause() { this.playing = false; $("play").textContent = "Play"; this.later(); }

  // Remember once the time stands still: an address is not written at each step.
  later() {
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => this.remember(), 300);
  }

  seek(time) {
    this.time = Math.min(Math.max(time, 0), this.duration);
    this.dirty = true;
    if (!this.playing) this.later();
  }

  // The rows around a time, as a number between theirs: rows are not evenly spaced.
  frameAt(time) {
    const {values: times} = this.film.times;
    let low = 0, high = times.length - 1;
    if (time <= 0) return 0;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= time) low = middle; else high = middle;
    }
    const span = times[high] - times[low];
    return low + (span > 0 ? Math.min((time - times[low]) / span, 1) : 0);
  }

  // Values of a packed array at a frame, between two rows.
  static sample({values, rows, columns}, frame) {
    const before = Math.min(Math.floor(frame), rows - 1), after = Math.min(before + 1, rows - 1);
    const w = Math.min(frame - before, 1), row = new Float32Array(columns);
    for (let c = 0; c < columns; c++) {
      const a = values[before * columns + c], b = values[after * columns + c];
      row[c] = w === 0 ? a : a + w * (b - a);
    }
    return row;
  }

  draw() {
    const frame = this.frameAt(this.time);
    const view = Player.sample(this.film.view, frame);
    this.figures.forEach((figure) => {
      const {track} = figure;
      const row = {q: Player.sample(track.q, frame), feet: Player.sample(track.feet, frame)};
      for (const channel of track.channels) row[channel] = Player.sample(track[channel], frame);
      const past = [], first = Math.ceil(this.frameAt(this.time - TRAIL_SECONDS));
      for (let k = first; k <= frame; k++) past.push(Player.sample(track.feet, k));
      past.push(row.feet);
      figure.show(row, past);
    });
    this.place(view);
    $("scrub").value = this.time;
    $("clock").textContent = `${this.time.toFixed(2)} / ${this.duration.toFixed(2)} s`;
    this.status();
    this.plots.forEach((plot) => plot.mark(this.time));
    this.timeline.mark();
  }

  // An instant that the stream sends: 32-bit floats, see scene_encoding.row_bytes.
  stream(buffer) {
    const values = new Float32Array(buffer);
    let at = 0;
    const take = (count) => values.subarray(at, at += count);
    const view = take(2);
    this.pause();
    this.figures.forEach((figure) => {
      const {track} = figure, row = {};
      for (const key of ["q", "feet", ...track.channels]) row[key] = take(track[key].columns);
      figure.past = [...(figure.past || []), row.feet].slice(-40);
      figure.show(row, figure.past);
    });
    this.place(view);
    this.received = (this.received || 0) + 1;
    this.dirty = false; this.rendering = true;
  }

  place(view) {
    if (this.following || !this.stood) this.stood = [...view];
    view = this.stood;
    this.world.position.set(-view[0], -view[1], 0);
    const wrap = (x) => -(x - 2 * TILE * Math.floor(x / (2 * TILE)));
    this.ground.position.set(wrap(view[0]), wrap(view[1]), 0);
  }

  // The phase and stride in which a robot is: [t, stride, phase], or null.
  markOf(track) {
    const now = this.time + this.film.start + 1e-6;
    let mark = null;
    for (const entry of track.marks) { if (entry[0] > now) break; mark = entry; }
    return mark;
  }

  // Load the strides with one of this number, where the menu has a window with it.
  async strides(k) {
    const select = this.selects.find((each) => each.dataset.option === "strides");
    const windows = select ? [...select.options].map((option) => option.value) : [];
    const starts = windows.filter((w) => /^from \d+ on$/.test(w)).map((w) => +w.split(" ")[1]);
    const first = Math.max(...starts.filter((start) => start <= k));
    const last = this.leader.history ? this.leader.history.stride.at(-1) : 0;
    const near = k > last - 12 && windows.includes("the last ones") ? "the last ones" : null;
    const wanted = Number.isFinite(first) ? `from ${first} on` : near;
    if (!wanted) return;
    select.value = wanted;
    await this.load("strides");
  }

  // Phase and stride of each robot, on the screen.
  status() {
    this.words.forEach((words, track) => {
      const mark = this.markOf(track);
      words.textContent = mark
        ? ` - stride ${mark[1]}, ${mark[2]}${errorsOf(track, mark[1])}` : "";
      if (mark && track === this.leader && document.activeElement !== $("stride")) {
        for (const option of $("stride").options) {
          if (option.text === String(mark[1])) $("stride").value = option.value;
        }
      }
    });
  }

  // One frame of the screen; the clock is the wall's, so that a slow screen leaves frames out.
  tick(now) {
    requestAnimationFrame((next) => this.tick(next));
    const elapsed = (now - (this.last || now)) / 1000;
    this.last = now;
    if (!this.film) return;
    if (this.playing && this.duration > 0) {
      this.time = (this.time + elapsed * $("rate").value) % this.duration;
      this.dirty = true;
    }
    if (this.dirty) { this.draw(); this.rendering = true; }
    if (this.rendering || this.viewer.controls.enableDamping) {
      this.viewer.render();
      this.drawn += 1;
      this.ready = true;
    }
    this.dirty = this.rendering = false;
  }
}
