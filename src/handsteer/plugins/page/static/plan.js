// The plan of a world from above: fits what is in it; press and drag to move a thing, or to draw a wall or a gate.
const FARTHEST_M = 1000;
const LEAST_M = 0.1;
const TURN = Math.PI / 12;

export default {
  template: `
    <svg :class="['plan', tool]" :viewBox="viewBox" role="img" :aria-label="label" xmlns="http://www.w3.org/2000/svg"
         @pointerdown="press" @pointermove="move" @pointerup="release" @pointercancel="drag = null" @wheel.prevent="wheel">
      <defs>
        <pattern :id="grid" width="1" height="1" patternUnits="userSpaceOnUse">
          <path class="line" d="M0 0H1M0 0V1" />
        </pattern>
      </defs>
      <rect x="-1000" y="-1000" width="2000" height="2000" :fill="'url(#' + grid + ')'" />
      <g transform="scale(1 -1)">
        <path class="start" d="M-0.25 -0.25H0.25V0.25H-0.25Z" />
        <g v-for="(gate, at) in gates" :key="'g' + at" :class="['gate', { chosen: isChosen('gates', at) }]"
           :transform="place(gate, 'gates', at)" :data-at="at" data-section="gates">
          <path class="grip" :d="'M0 ' + gate.width / 2 + 'V' + -gate.width / 2" />
          <path :d="'M0 ' + gate.width / 2 + 'V' + -gate.width / 2 + 'M0.06 0.1L0.18 0L0.06 -0.1'" />
          <circle class="left" :cy="gate.width / 2" r="0.07" /><circle class="right" :cy="-gate.width / 2" r="0.07" />
          <text :transform="'translate(-0.2 0) rotate(' + -gate.turn + ') scale(1 -1)'" y="0.09">{{ at + 1 }}</text>
        </g>
        <g v-for="(thing, at) in things" :key="'t' + at" :class="['thing', { chosen: isChosen('obstacles', at) }]"
           :transform="place(thing, 'obstacles', at)" :data-at="at" data-section="obstacles">
          <title>{{ thing.name }}</title>
          <rect v-if="thing.shape === 'box'" :x="-thing.length / 2" :y="-thing.width / 2" :width="thing.length" :height="thing.width" :fill="thing.colour" />
          <circle v-else :r="thing.length / 2" :fill="thing.colour" />
        </g>
        <path class="robot" :transform="'translate(' + pose[0] + ' ' + pose[1] + ') rotate(' + pose[2] + ')'"
              d="M-0.22 -0.24H0.1L0.26 0L0.1 0.24H-0.22Z" />
        <line v-if="drag?.to" :class="['drawn', tool]" :x1="drag.from[0]" :y1="drag.from[1]" :x2="drag.to[0]" :y2="drag.to[1]" />
      </g>
    </svg>`,
  props: { things: Array, gates: Array, chosen: Array, tool: String, snap: Boolean, label: String, bounds: Array },
  data: () => ({ pose: [0, 0, 0], drag: null, view: null }),
  computed: {
    grid() { return `grid-${this.$.uid}`; },
    shown() { return this.view ?? this.bounds; },
    viewBox() {
      const [x, y, width, height] = this.shown;
      return `${x} ${-y - height} ${width} ${height}`;
    },
  },
  mounted() { document.addEventListener("keydown", this.key); },
  unmounted() { document.removeEventListener("keydown", this.key); },
  methods: {
    go(x, y, degrees) { this.pose = [x, y, degrees]; },
    fit() { this.view = null; },
    zoom(factor, at) {
      const [x, y, width, height] = this.shown;
      if (width * factor > FARTHEST_M || width * factor < 1) return;
      const [atX, atY] = at ?? [x + width / 2, y + height / 2];
      this.view = [atX + (x - atX) * factor, atY + (y - atY) * factor, width * factor, height * factor];
    },
    wheel(event) { this.zoom(event.deltaY > 0 ? 1.15 : 1 / 1.15, this.point(event)); },
    isChosen(section, at) { return this.chosen?.[0] === section && this.chosen[1] === at; },
    place(shape, section, at) {
      const isDragged = this.drag?.section === section && this.drag.at === at;
      const [x, y] = isDragged ? this.drag.place : [shape.x, shape.y];
      return `translate(${x} ${y}) rotate(${shape.turn})`;
    },
    point(event) {
      const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(this.$el.getScreenCTM().inverse());
      return [point.x, -point.y];
    },
    snapped(value) { return Math.round(value * (this.snap ? 10 : 100)) / (this.snap ? 10 : 100); },
    // The end of a line that begins at from: in steps of 15 degrees and 0.1 m.
    end([x, y], [toX, toY]) {
      if (!this.snap) return [this.snapped(toX), this.snapped(toY)];
      const turn = Math.round(Math.atan2(toY - y, toX - x) / TURN) * TURN;
      const length = this.snapped(Math.hypot(toX - x, toY - y));
      return [x + length * Math.cos(turn), y + length * Math.sin(turn)];
    },
    press(event) {
      if (!event.isPrimary || event.button) return;
      this.$el.setPointerCapture(event.pointerId);
      const at = this.point(event);
      if (this.tool !== "move") {
        this.drag = { from: at.map(this.snapped), to: at.map(this.snapped) };
        return;
      }
      const grip = event.target.closest("[data-section]");
      if (!grip) {
        this.drag = { pan: at, view: this.shown };
        return;
      }
      const section = grip.dataset.section, index = Number(grip.dataset.at);
      const { x, y } = (section === "gates" ? this.gates : this.things)[index];
      this.drag = { section, at: index, offset: [x - at[0], y - at[1]], place: [x, y], moved: false };
      this.$emit("pick", { section, index });
    },
    move(event) {
      const drag = this.drag;
      if (!drag) return;
      const [x, y] = this.point(event);
      if (drag.pan) {
        const [left, bottom, width, height] = this.shown;
        this.view = [left + drag.pan[0] - x, bottom + drag.pan[1] - y, width, height];
      } else if (drag.from) drag.to = this.end(drag.from, [x, y]);
      else {
        drag.place = [this.snapped(x + drag.offset[0]), this.snapped(y + drag.offset[1])];
        drag.moved = true;
      }
    },
    release() {
      const drag = this.drag;
      this.drag = null;
      if (!drag || drag.pan) return;
      if (drag.from) {
        const isLong = Math.hypot(drag.to[0] - drag.from[0], drag.to[1] - drag.from[1]) >= LEAST_M;
        if (isLong) this.$emit("draw", { tool: this.tool, from: drag.from, to: drag.to });
      } else if (drag.moved) this.$emit("drop", { section: drag.section, index: drag.at, x: drag.place[0], y: drag.place[1] });
    },
    key(event) {
      if (event.target.closest?.("input, textarea, [contenteditable]")) return;
      const isUndo = (event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "z";
      const action = isUndo ? (event.shiftKey ? "redo" : "undo") : event.key === "Delete" ? "delete" : null;
      if (!action) return;
      event.preventDefault();
      this.$emit("key", action);
    },
  },
};
