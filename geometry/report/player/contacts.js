// SPDX-License-Identifier: MIT
// Edits the contacts of a transfer to a robot: each is a sphere on the object and one in a part of
// the hand, and both can be dragged.
import { Vector3 } from "three";

import { ContactView } from "./contact_view.js";
import { readHeader, readPayload } from "./decode.js";
import { element, find } from "./dom.js";

const kReach = 14; // pixels from a sphere's center within which it is grasped

const vectorOf = (values) => new Vector3(...values);
const rounded = (vector) => vector.toArray().map((x) => Math.round(1e7 * x) / 1e7);
const together = (a, b) => a.frames[0] <= b.frames[1] && b.frames[0] <= a.frames[1];

class ContactEditor {
  constructor(header, arrays) {
    this.header = header;
    this.arrays = arrays;
    this.view = new ContactView(find("canvas"), header, arrays);
    this.view.showFrame(header.frames[0]);
    this.reset();
    const normals = this.contacts.map(({ normal }) => vectorOf(normal));
    this.view.lookFrom(normals.reduce((sum, normal) => sum.add(normal), new Vector3()));
    this.listen(this.view.canvas, this.view.stage.controls);
  }

  // A contact: the values of an entry of the file, the entry that it was, and its row of the list.
  contact(values, was = null) {
    const name = element("button", { title: "Show this contact" });
    const remove = element("button", {}, "Remove");
    const texts = [name, values.frames.join(" to "), "", remove];
    const cells = texts.map((text) => element("td", {}, text));
    const contact = { ...values, was, name, moved: cells[2], row: element("tr", {}, ...cells) };
    name.addEventListener("click", () => this.choose(contact));
    remove.addEventListener("click", () => this.set(this.contacts.filter((c) => c !== contact)));
    return contact;
  }

  set(contacts) {
    this.contacts = contacts;
    if (!contacts.includes(this.selected)) this.selected = contacts[0];
    find("contacts").replaceChildren(...contacts.map(({ row }) => row));
    this.draw();
  }

  reset() {
    this.set(this.header.file.contacts.map((entry) => this.contact(entry, entry)));
  }

  add() {
    const { hold: frames, parts } = this.header;
    const names = ["index3", ...parts.filter((part) => part.on_robot).map((part) => part.name)];
    const free = (part) => !this.contacts.some((c) => c.part === part && together(c, { frames }));
    const { point, normal } = this.view.middle();
    const at = { point: rounded(point), normal: rounded(normal) };
    const contact = this.contact({ part: names.find(free) ?? names[0], frames, ...at });
    this.set([...this.contacts, contact]);
    this.choose(contact);
  }

  choose(contact) {
    const away = (frame) => Math.abs(frame - contact.frames[0]);
    this.selected = contact;
    this.view.showFrame([...this.header.frames].sort((a, b) => away(a) - away(b))[0]);
    this.view.turnTo(vectorOf(contact.point), vectorOf(contact.normal));
    this.draw();
  }

  // Contacts in the frame shown, with the places of their spheres.
  marked() {
    const now = { frames: [this.view.frame, this.view.frame] };
    return this.contacts
      .filter((contact) => contact === this.selected || together(contact, now))
      .map((contact) => ({
        contact,
        large: contact === this.selected,
        object: vectorOf(contact.point),
        hand: this.view.centers[contact.part],
      }));
  }

  draw() {
    this.view.draw(this.marked(), this.selected?.part);
    for (const contact of this.contacts) {
      const { part, point, was } = contact;
      const mm = was ? 1e3 * vectorOf(point).distanceTo(vectorOf(was.point)) : 0;
      const changes = [mm > 0 && `${mm.toFixed(1)} mm`, part !== was?.part && `was ${was?.part}`];
      contact.name.textContent = part;
      contact.moved.textContent = was ? changes.filter(Boolean).join(", ") : "new";
      contact.row.classList.toggle("selected", contact === this.selected);
    }
    find("frame").textContent = `Hand in frame ${this.view.frame}`;
    find("problem").textContent = this.problem();
    find("save").disabled = this.problem() !== "";
  }

  // Why 'holdfast transfer' would refuse the file.
  problem() {
    if (this.contacts.length === 0) return "No contact is left.";
    const clashes = (a, b) => a !== b && a.part === b.part && together(a, b);
    const twice = this.contacts.find((a) => this.contacts.some((b) => clashes(a, b)));
    return twice ? `${twice.part} has two contacts at once: remove one or change its part.` : "";
  }

  save() {
    const values = ({ frames, normal, part, point }) => ({ frames, normal, part, point });
    const file = { ...this.header.file, contacts: this.contacts.map(values) };
    const text = `${JSON.stringify(file, null, 1)}\n`;
    const href = URL.createObjectURL(new Blob([text], { type: "application/json" }));
    element("a", { href, download: "contacts.json" }).click();
    setTimeout(() => URL.revokeObjectURL(href), 1000);
  }

  // The sphere at the pointer: its contact, its end of it, and the pointer's distance from it.
  grasp({ clientX, clientY }) {
    let best = null;
    for (const { contact, object, hand } of this.marked()) {
      for (const [end, at] of Object.entries({ object, hand })) {
        const [x, y] = this.view.pixel(at);
        const offset = [x - clientX, y - clientY];
        const away = Math.hypot(...offset);
        if (away >= (best?.away ?? kReach) || !this.view.seen(at)) continue;
        best = { contact, end, offset, away };
      }
    }
    return best;
  }

  drag({ contact, end, offset }, { clientX, clientY }) {
    const hit = this.view.hit([clientX + offset[0], clientY + offset[1]], this.view[end]);
    if (!hit) return;
    if (end === "object") {
      contact.point = rounded(hit.point);
      contact.normal = rounded(hit.face.normal);
    } else {
      const { name, on_robot } = this.header.parts[this.arrays.hand_part[hit.face.a]];
      if (on_robot) contact.part = name;
    }
    this.draw();
  }

  listen(canvas, controls) {
    let dragged = null;
    const down = (event) => {
      dragged = event.button === 0 ? this.grasp(event) : null;
      if (!dragged) return;
      controls.enabled = false;
      canvas.setPointerCapture(event.pointerId);
      this.selected = dragged.contact;
      this.draw();
    };
    canvas.addEventListener("pointerdown", down, { capture: true }); // before the controls
    canvas.addEventListener("pointermove", (event) => {
      if (dragged) this.drag(dragged, event);
      else if (event.buttons === 0) canvas.classList.toggle("over", this.grasp(event) !== null);
    });
    canvas.addEventListener("lostpointercapture", () => {
      dragged = null;
      controls.enabled = true;
    });
    for (const name of ["add", "reset", "save"]) {
      find(name).addEventListener("click", () => this[name]());
    }
  }
}

const header = readHeader();
find("command").textContent = header.command;
const ready = readPayload(0, header.arrays)
  .then((arrays) => {
    window.holdfast.editor = new ContactEditor(header, arrays);
  })
  .catch((error) => {
    find("problem").textContent = `Contacts cannot be edited here (${error.message}).`;
    throw error;
  });
window.holdfast = { ready };
