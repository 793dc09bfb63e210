"use strict";
// The controls of a live session around the player of player.js, which draws the robots. What a page
// may ask is in lab_messages.py; what it is told, in lab_server.py.

const SHOWN = 48;          // strides in a chart
const PUSHED_MS = 450;     // how long the arrow of a push stands
const PER_METRE = 25;      // N s for each metre that the trunk is dragged
const PUSH_COLOR = 0xd6006c;
const STYLE = `
  #lab { display: grid; gap: 8px; margin-bottom: 10px; }
  #lab fieldset { border: 1px solid #ddd; border-radius: 4px; margin: 0; padding: 4px 8px 6px; min-width: 0; }
  #lab legend { font-weight: 600; font-size: 13px; padding: 0 4px; }
  #side #lab label { display: grid; grid-template-columns: 1fr auto; gap: 0 8px; margin: 0 0 2px; }
  #side #lab label span { width: auto; }
  #lab output { font-variant-numeric: tabular-nums; }
  #lab input[type=range] { grid-column: 1 / -1; width: 100%; margin: 0; min-height: 18px; }
  #lab button, #bar button { font: inherit; min-width: 0; padding: 2px 8px; }
  #lab .robot { display: flex; flex-wrap: wrap; gap: 4px; align-items: center; padding: 3px 0; border-top: 1px solid #eee; }
  #lab .robot:first-of-type { border-top: 0; }
  #lab .robot i { width: 12px; height: 12px; border: 1px solid #0004; }
  #lab .robot select { flex: 1 0 80%; min-width: 90px; font: inherit; }
  #lab .robot button { font-size: 12px; }
  #lab button[aria-pressed=true], #bar button[aria-pressed=true] { background: #d55e00; color: #fff; }
  #lab .row { display: flex; flex-wrap: wrap; gap: 4px; }
  #charts { flex: 0 0 100%; display: grid; grid-template-columns: repeat(4, 1fr); gap: 2px 12px; }
  #charts figure { margin: 0; min-width: 0; }
  #charts figcaption { font-size: 12px; color: #555; white-space: nowrap; overflow: hidden; text-overflow: ellipsis; }
  #charts canvas { width: 100%; height: 104px; display: block; }
  #live-clock { flex: 1; text-align: right; font-variant-numeric: tabular-nums; color: #555; font-size: 12px; }
  #plots, #side > label, #track, #run, #clock, #rate, #play { display: none !important; }
  #side > label:has(#colour) { display: flex !important; }
  .watching #lab :is(button, input, select), .watching #bar :is(button:not(#drawer), select) { pointer-events: none; opacity: 0.45; }
  @media (max-width: 640px) {
    #charts { grid-template-columns: 1fr 1fr; }
    #charts canvas { height: 62px; }
    body.open #side { max-height: 62vh; }
    #lab button, #bar button { padding: 6px 10px; }
    #views { display: none; }
  }
`;

const make = (tag, attributes = {}, ...children) => {
  const element = Object.assign(document.createElement(tag), attributes);
  element.append(...children);
  return element;
};
const digits = (step) => Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
let player, lab;

// Bars of a quantity over the strides, one group a stride, and the model's level as a line.
class Chart {
  constructor(title, unit, value, factor, {signed = false, level = true} = {}) {
    Object.assign(this, {title, unit, value, factor, signed, level});
    this.caption = make("figcaption");
    this.canvas = make("canvas", {role: "img", ariaLabel: `${title} [${unit}] over strides`});
    this.figure = make("figure", {}, this.caption, this.canvas);
  }

  of(stride) { return this.factor * stride[this.value]; }

  draw(strides, robots, marks) {
    const {canvas} = this, width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width || !robots.length) return;
    const ratio = window.devicePixelRatio;
    canvas.width = width * ratio; canvas.height = height * ratio;
    const pen = canvas.getContext("2d");
    pen.scale(ratio, ratio);
    const shown = strides.map((kept) => kept.slice(-SHOWN));
    const values = shown.flat().map((s) => this.of(s)).filter(Number.isFinite);
    let high = Math.max(...values, 1e-3), low = this.signed ? Math.min(...values, 0) : 0;
    const step = niceStep((high - low) / 3);
    high = Math.ceil(high / step) * step; low = Math.floor(low / step) * step;
    const left = 34, y = (v) => 4 + (height - 8) * (high - v) / (high - low);
    pen.font = "10px system-ui, sans-serif"; pen.fillStyle = "#555"; pen.strokeStyle = "#e2e2e2";
    pen.textAlign = "right"; pen.textBaseline = "middle";
    for (let v = low; v < high + step / 2; v += step) {
      pen.fillText(String(Number(v.toPrecision(3))), left - 4, y(v));
      line(pen, [[left, y(v)], [width, y(v)]]);
    }
    const models = robots.map((robot, k) => k).filter((k) => this.level && robots[k].name === "model");
    const bars = robots.map((robot, k) => k).filter((k) => !models.includes(k));
    const group = (width - left) / SHOWN, bar = Math.max((group - 1) / Math.max(bars.length, 1), 1);
    bars.forEach((k, place) => {
      shown[k].forEach((stride, i) => {
        pen.fillStyle = stride.color;
        const x = left + group * (SHOWN - shown[k].length + i) + bar * place, v = this.of(stride);
        if (Number.isFinite(v)) pen.fillRect(x, Math.min(y(0), y(v)), bar, Math.max(Math.abs(y(v) - y(0)), 0.5));
      });
    });
    for (const k of models) {
      const last = shown[k].slice(-8).map((s) => this.of(s)).filter(Number.isFinite);
      if (!last.length) continue;
      const mean = last.reduce((a, b) => a + b, 0) / last.length;
      pen.strokeStyle = robots[k].color; pen.lineWidth = 1.6; pen.setLineDash([5, 3]);
      line(pen, [[left, y(mean)], [width, y(mean)]]);
      pen.setLineDash([]); pen.textAlign = "left";
      const label = "the model's level", top = Math.max(y(mean) - 7, 8);
      pen.fillStyle = "rgba(255, 255, 255, 0.85)";  // on bars nobody could read it
      pen.fillRect(left + 1, top - 6, pen.measureText(label).width + 4, 12);
      pen.fillStyle = robots[k].color;
      pen.fillText(label, left + 3, top);
    }
    pen.lineWidth = 1.2;
    const told = new Set();
    for (const {robot, time, color, words, row} of marks) {
      const kept = shown[robot], at = kept.findIndex((stride) => stride.time > time);
      if (at < 0 || (at === 0 && strides[robot].length > SHOWN)) continue;
      const x = left + group * (SHOWN - kept.length + at);
      pen.strokeStyle = pen.fillStyle = color;
      line(pen, [[x, 0], [x, height]]);
      if (told.has(`${Math.round(x)} ${row}`)) continue;  // of another robot
      told.add(`${Math.round(x)} ${row}`);
      pen.textAlign = x > width - 70 ? "right" : "left";
      pen.fillText(words, x + (x > width - 70 ? -3 : 3), 7 + 11 * row);
    }
    const last = bars.map((k) => shown[k].at(-1)).filter(Boolean).map((s) => this.of(s));
    const words = last.map((v) => (Number.isFinite(v) ? v.toFixed(Math.abs(v) < 10 ? 1 : 0) : "-")).join(" / ");
    this.caption.textContent = `${this.title} [${this.unit}]  ${words}`;
  }
}

class Lab {
  static async start(settings) {
    lab = new Lab(settings);
    const robot = await lab.bytes("robot");
    player = await Player.start({robot, options: {}, first: {}, film: () => lab.bytes("film")});
    lab.listen();
  }

  constructor(settings) {
    this.settings = settings;
    this.token = new URLSearchParams(location.search).get("token") || "";
    this.strides = []; this.events = []; this.state = {robots: []}; this.driving = false;
    this.counts = {frames: 0, strides: 0, arrows: 0};  // what was drawn, and told
    document.head.append(make("style", {textContent: STYLE}));
    this.charts = [
      new Chart("calf error", "mrad", "calf", 1000), new Chart("thigh error", "mrad", "thigh", 1000),
      new Chart("feedback's share", "%", "feedback_share", 100, {level: false}),
      new Chart("touchdown, late by", "ms", "touchdown", 1000, {signed: true, level: false}),
    ];
    this.panel(); this.bar(); this.dragging();
    // Before the player's own keys: space pauses the robots, and an arrow goes on by a stride.
    document.addEventListener("keydown", (event) => {
      const id = {" ": "pause", ArrowRight: "step", l: "learn"}[event.key];
      if (!id || event.ctrlKey || event.metaKey || event.target.matches("select, input, button")) return;
      $(id).click();
      event.preventDefault(); event.stopImmediatePropagation();
    }, {capture: true});
    window.addEventListener("resize", () => { this.dirty = true; });
    const tick = () => { if (this.dirty) this.draw(); requestAnimationFrame(tick); };
    tick();
  }

  url(path, words = {}) { return `${path}?${new URLSearchParams({token: this.token, ...words})}`; }

  async bytes(path) {
    const answer = await fetch(this.url(path)).catch(() => { throw new Error("The program has ended."); });
    if (!answer.ok) throw new Error(await answer.text());
    return answer.arrayBuffer();
  }

  // --- the connection -----------------------------------------------------------------------

  listen() {
    const address = (path) => new URL(this.url(path), location.href).href.replace(/^http/, "ws");
    const stream = new WebSocket(address("stream"));
    stream.binaryType = "arraybuffer";
    stream.onmessage = ({data}) => { this.counts.frames += 1; player.stream(data); this.arrows(); };
    this.socket = new WebSocket(address("lab"));
    this.socket.onmessage = ({data}) => this.told(JSON.parse(data));
    this.socket.onclose = () => {
      $("state").textContent = "The program behind this page has ended; it is looked for again.";
      setTimeout(() => fetch(this.url("film")).then((answer) => answer.ok && location.reload())
        .catch(() => this.socket.onclose()), 1000);
    };
  }

  ask(message) {
    if (this.socket && this.socket.readyState === 1) this.socket.send(JSON.stringify(message));
  }

  // A slider that moves asks ten times a second at most, and once it stands.
  softly(name, message) {
    this.later = this.later || {};
    const now = performance.now(), waiting = this.later[name] || {then: 0};
    clearTimeout(waiting.timer);
    const wait = Math.max(0, 100 - (now - waiting.then));
    waiting.timer = setTimeout(() => { waiting.then = performance.now(); this.ask(message); }, wait);
    this.later[name] = waiting;
  }

  told(message) {
    if (message.reset) { this.strides = this.strides.map(() => []); this.events = []; }
    if ("driving" in message) {
      this.driving = message.driving;
      document.body.classList.toggle("watching", !this.driving);
      $("drives").textContent = this.driving ? "" : "another page drives; this one watches";
    }
    if (message.state) this.show(message.state);
    if (message.events) this.events = [...this.events, ...message.events].slice(-300);
    for (const event of message.events || []) if (event.do === "push") this.pushed(event);
    for (const [robot, stride] of message.strides || []) {
      const kept = this.strides[robot] = this.strides[robot] || [];
      if (stride.number === 0) kept.length = 0;
      else if (kept.length && stride.number <= kept.at(-1).number) continue;  // told twice at first
      kept.push(stride); this.counts.strides += 1;
      if (kept.length > 400) kept.shift();
    }
    if (message.scene && player) player.load();
    if (message.refused || message.said) {
      $("state").textContent = message.refused || message.said;
      clearTimeout(this.words);
      this.words = setTimeout(() => { $("state").textContent = ""; }, 8000);
    }
    this.dirty = true;
  }

  // --- controls -----------------------------------------------------------------------------

  slider(text, unit, low, high, step, value, asks) {
    const output = make("output"), input = make("input", {type: "range", min: low, max: high, step, value});
    const told = () => { output.textContent = `${(+input.value).toFixed(digits(step))} ${unit === "1" ? "" : unit}`; };
    input.addEventListener("input", () => { told(); asks(+input.value); });
    const label = make("label", {}, make("span", {textContent: text}), output, input);
    label.set = (v) => { if (document.activeElement !== input) { input.value = v; } told(); };
    input.addEventListener("change", () => input.blur());
    told();
    return label;
  }

  button(text, title, does, id = "") {
    const button = make("button", {textContent: text, title, type: "button", id});
    button.addEventListener("click", () => does(button));
    return button;
  }

  panel() {
    const {settings} = this, [slowest, fastest] = settings.speeds;
    this.speed = this.slider("commanded speed", "m/s", slowest, fastest, 0.05, 0,
      (speed) => this.softly("speed", {do: "speed", speed}));
    this.speed.querySelector("input").id = "speed";
    this.knobs = settings.knobs.map((knob) => {
      const label = this.slider(knob.text, knob.unit, knob.low, knob.high, knob.step, knob.usual,
        () => this.softly("world", {do: "world", values: this.world}));
      label.querySelector("input").id = `knob-${knob.name}`;
      return {...knob, label, input: label.querySelector("input")};
    });
    const impulse = this.slider("impulse", "N s", 1, settings.impulse, 0.5, 6, () => {});
    impulse.querySelector("input").id = "impulse";
    const push = (x, z) => {
      const size = +impulse.querySelector("input").value;
      this.ask({do: "push", impulse: [x * size, 0, z * size]});
    };
    const field = (name, ...children) => make("fieldset", {}, make("legend", {textContent: name}), ...children);
    this.robots = make("div", {id: "robots"});
    const panel = make("div", {id: "lab"},
      make("div", {id: "drives"}),
      field("all robots", this.speed, make("div", {className: "row"},
        this.button("learn", "switch learning on for all that can", (b) =>
          this.ask({do: "learning", on: b.getAttribute("aria-pressed") !== "true"}), "learn"),
        this.button("forget", "play again what they began with", () => this.ask({do: "forget"}), "forget"))),
      field("robots", this.robots),
      field("push (or drag a trunk)", impulse, make("div", {className: "row"},
        this.button("← back", "push backward", () => push(-1, 0), "push-back"),
        this.button("forward →", "push forward", () => push(1, 0), "push-forward"),
        this.button("↑ up", "push upward", () => push(0, 1)),
        this.button("↓ down", "push downward", () => push(0, -1)))),
      field("world", ...this.knobs.map(({label}) => label),
        this.button("as it was", "undo all of it", () => this.ask({do: "world", values: {}}))));
    $("side").prepend(panel);
  }

  get world() {
    const moved = this.knobs.filter(({input, usual, step}) => Math.abs(+input.value - usual) > step / 2);
    return Object.fromEntries(moved.map(({name, input}) => [name, +input.value]));
  }

  bar() {
    this.rate = make("select", {id: "live-rate", ariaLabel: "rate of the simulation"},
      ...[0.05, 0.1, 0.25, 0.5, 1, 2, 4].map((rate) =>
        new Option(rate === 1 ? "real time" : rate < 1 ? `1/${1 / rate} speed` : `${rate} times`, rate)));
    this.rate.addEventListener("change", () => this.ask({do: "rate", rate: +this.rate.value}));
    const charts = make("div", {id: "charts"}, ...this.charts.map(({figure}) => figure));
    const clock = make("span", {id: "live-clock"});
    $("bar").prepend(charts,
      this.button("pause", "pause, or go on", () => this.ask({do: "pause", paused: !this.state.paused}), "pause"),
      this.button("one stride", "go on to the next touchdown", () => this.ask({do: "step"}), "step"),
      this.button("stand up", "begin again from standing, with all that was learned",
        () => this.ask({do: "reset", forget: false}), "stand-up"),
      this.button("reset", "begin again from standing, with nothing learned",
        () => this.ask({do: "reset", forget: true}), "reset"),
      this.button("record", "record to a results folder", () =>
        this.ask({do: "record", on: !this.state.recording}), "record"),
      this.rate, clock);
  }

  show(state) {
    this.state = state;
    this.speed.set(state.speed);
    for (const {name, usual, label} of this.knobs) label.set(name in state.world ? state.world[name] : usual);
    const pressed = (id, on) => $(id).setAttribute("aria-pressed", on);
    $("pause").textContent = state.paused ? "go on" : "pause";
    $("record").textContent = state.recording ? "save" : "record";
    pressed("record", Boolean(state.recording));
    const learners = state.robots.filter(({learns}) => learns);
    pressed("learn", learners.length > 0 && learners.every(({learning}) => learning));
    if (document.activeElement !== this.rate) this.rate.value = state.rate;
    while (this.strides.length < state.robots.length) this.strides.push([]);
    if (!this.robots.contains(document.activeElement)) {
      this.robots.replaceChildren(...state.robots.map((robot, k) => this.robot(robot, k)));
    }
  }

  robot(robot, k) {
    const select = make("select", {ariaLabel: `controller of robot ${k + 1}`});
    const known = [...new Set([...this.settings.controllers, robot.name])];
    known.forEach((name) => select.add(new Option(name, name)));
    select.value = robot.name;
    select.addEventListener("change", () => {
      this.ask({do: "controller", robot: k, name: select.value});
      select.blur();
    });
    const file = make("input", {type: "file", accept: ".npz", hidden: true});
    file.addEventListener("change", () => this.load(k, file));
    const learn = this.button("learn", "switch its learning on or off", () =>
      this.ask({do: "learning", robot: k, on: !robot.learning}));
    learn.setAttribute("aria-pressed", robot.learns && robot.learning);
    learn.hidden = !robot.learns;
    const swatch = make("i");
    swatch.style.background = robot.color;
    return make("div", {className: "robot"}, swatch, select, learn,
      this.button("forget", "play again what it began with", () => this.ask({do: "forget", robot: k})),
      this.button("save", "save its skill to a file", () => this.save(k)),
      this.button("load", "load a skill from a file", () => file.click()), file);
  }

  async save(k) {
    try {
      const data = await fetch(this.url("skill", {robot: k}));
      if (!data.ok) throw new Error(await data.text());
      const link = make("a", {href: URL.createObjectURL(await data.blob()), download: "skill.npz"});
      link.click();
      URL.revokeObjectURL(link.href);
    } catch (error) { this.told({refused: error.message}); }
  }

  async load(k, file) {
    const answer = await fetch(this.url("skill", {robot: k}), {method: "POST", body: file.files[0]});
    file.value = "";
    this.told(answer.ok ? {said: "The skill is played from the next touchdown on."} : {refused: await answer.text()});
  }

  // --- what is drawn ------------------------------------------------------------------------

  draw() {
    this.dirty = false;
    const {robots} = this.state, marks = [];
    for (const event of this.events) {
      if (event.do !== "learning" && event.do !== "world") continue;
      const learns = event.do === "learning";
      robots.forEach((robot, k) => {
        const meant = event.robot === null || event.robot === undefined || event.robot === k;
        if (!meant || (learns ? !robot.learns : k !== robots.length - 1)) return;
        marks.push({robot: k, time: event.time[k], color: learns ? "#d55e00" : "#8a4f7d",
                    words: learns ? (event.on ? "learning" : "off") : "world", row: learns ? 0 : 1});
      });
    }
    this.charts.forEach((chart) => chart.draw(this.strides, robots, marks));
    const last = this.strides.map((kept) => kept.at(-1)).filter(Boolean);
    if (!last.length) return;
    const fallen = this.strides.filter((kept) => kept.length && !kept.at(-1).upright).length;
    $("live-clock").textContent = `${last[0].time.toFixed(1)} s, stride ${last[0].number}, ` +
      last.map(({speed}) => speed.toFixed(2)).join(" / ") + " m/s" +
      (fallen ? `; ${fallen} fallen: stand up` : "");
  }

  trunk(k) { return player.figures[k] && player.figures[k].nodes[1]; }

  arrowOf(k) {
    this.pushArrows = this.pushArrows || new Map();
    if (!this.pushArrows.has(k)) {
      // Seen through the trunk that it ends in.
      const arrow = new THREE.Mesh(ARROW, new THREE.MeshBasicMaterial({color: PUSH_COLOR,
        depthTest: false, transparent: true, opacity: 0.9}));
      arrow.name = "push"; arrow.renderOrder = 9;
      player.world.add(arrow);
      this.pushArrows.set(k, arrow);
    }
    return this.pushArrows.get(k);
  }

  // Point an arrow with its tip at a robot's trunk; its length goes with the impulse [N s].
  point(k, impulse) {
    const arrow = this.arrowOf(k), way = new THREE.Vector3(...impulse), size = way.length();
    arrow.visible = size > 0;
    if (!size || !this.trunk(k)) return;
    way.divideScalar(size);
    const length = Math.max(size / PER_METRE, 0.08);
    arrow.scale.set(2, 2, length);
    arrow.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), way);
    arrow.position.copy(this.trunk(k).position).addScaledVector(way, -length);
  }

  pushed(event) {
    const until = performance.now() + PUSHED_MS;
    this.state.robots.forEach((robot, k) => {
      if (event.robot !== null && event.robot !== undefined && event.robot !== k) return;
      this.pushes = this.pushes || new Map();
      this.pushes.set(k, {impulse: event.impulse, until});
    });
  }

  arrows() {
    for (const [k, {impulse, until}] of this.pushes || []) {
      if (performance.now() > until) { this.arrowOf(k).visible = false; this.pushes.delete(k); }
      else { this.point(k, impulse); this.counts.arrows += 1; }
    }
    if (this.drag) this.point(this.drag.robot, this.drag.impulse);
    player.rendering = true;
  }

  // Drag a trunk: an arrow shows the push that it gets once it is let go. The trunk moves in x and z.
  dragging() {
    const pane = $("pane");
    const ray = (event) => {
      const box = pane.getBoundingClientRect(), caster = new THREE.Raycaster();
      const place = new THREE.Vector2(2 * (event.clientX - box.left) / box.width - 1,
                                      1 - 2 * (event.clientY - box.top) / box.height);
      caster.setFromCamera(place, player.viewer.camera);
      return caster;
    };
    const grab = (event) => {
      if (!player || !this.driving || event.target.tagName !== "CANVAS") return;
      const caster = ray(event);
      const hits = player.figures.flatMap((figure, robot) => {
        const trunk = figure.parts.filter(({joint}) => joint < 0).map(({mesh}) => mesh);
        return caster.intersectObjects(trunk).map(({point, distance}) => ({robot, point, distance}));
      }).sort((a, b) => a.distance - b.distance);
      if (!hits.length) return;
      const normal = player.viewer.camera.getWorldDirection(new THREE.Vector3());
      const plane = new THREE.Plane().setFromNormalAndCoplanarPoint(normal, hits[0].point);
      this.drag = {robot: hits[0].robot, from: hits[0].point, plane, impulse: [0, 0, 0]};
      event.stopPropagation(); event.preventDefault();
    };
    const move = (event) => {
      if (!this.drag) return;
      const {from, plane} = this.drag, to = ray(event).ray.intersectPlane(plane, new THREE.Vector3());
      if (!to) return;
      const local = (point) => player.earth.worldToLocal(point.clone());
      const way = local(to).sub(local(from)), most = this.settings.impulse;
      const bound = (v) => Math.min(Math.max(Math.round(PER_METRE * v * 2) / 2, -most), most);
      this.drag.impulse = [bound(way.x), 0, bound(way.z)];
      event.stopPropagation();
    };
    const drop = () => {
      if (!this.drag) return;
      const {robot, impulse} = this.drag;
      this.drag = null;
      this.arrowOf(robot).visible = false;
      if (impulse.some((v) => v)) this.ask({do: "push", robot, impulse});
    };
    for (const kind of ["pointerdown", "mousedown", "touchstart"]) {
      pane.addEventListener(kind, (event) => {
        if (kind === "pointerdown") grab(event); else if (this.drag) event.stopPropagation();
      }, {capture: true});
    }
    window.addEventListener("pointermove", move, {capture: true});
    window.addEventListener("pointerup", drop, {capture: true});
    window.addEventListener("pointercancel", drop, {capture: true});
  }
}
