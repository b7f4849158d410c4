// SPDX-License-Identifier: MIT
// node show_report.mjs CHROMIUM [WORD]: uses the reports beside this file as a person would, and
// checks what is seen; only the tests with WORD in their name. Leaves screenshots.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { readFileSync, writeFileSync } from "node:fs";
import { resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

const browser = await chromium.launch({
  executablePath: process.argv[2],
  args: ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});
const scratch = await browser.newPage(); // compares pictures

// Opens a report; whatever it complains about or fetches is kept.
async function open(file, options = {}) {
  const page = await browser.newPage({
    viewport: { width: 1440, height: 900 },
    reducedMotion: "reduce",
    ...options,
  });
  page.complaints = [];
  page.fetched = [];
  page.on("console", (message) => {
    // The software renderer of a machine without a GPU reports its own slow reads.
    if (["error", "warning"].includes(message.type()) && !message.text().includes("GPU stall")) {
      page.complaints.push(message.text());
    }
  });
  page.on("pageerror", (error) => page.complaints.push(error.message));
  page.on("request", (request) => page.fetched.push(request.url()));
  const begin = Date.now();
  await page.goto(pathToFileURL(resolve(file)).href);
  await page.evaluate(() => window.holdfast.ready);
  page.loadMs = Date.now() - begin;
  return page;
}

async function close(page) {
  assert.deepEqual(page.complaints, [], "the console is silent");
  const elsewhere = page.fetched.filter((url) => !/^(file|data|blob):/.test(url));
  assert.deepEqual(elsewhere, [], "nothing is fetched from anywhere");
  await page.close();
}

const frameOf = (page) => page.evaluate(() => window.holdfast.player.playback.frame);
const seek = (page, frame) =>
  page.evaluate((t) => window.holdfast.player.playback.seek(t), frame);

// The stage's pixels, once the camera has arrived and a picture is drawn.
async function picture(page, name) {
  await page.evaluate(
    () =>
      new Promise((done) => {
        let left = 4;
        const tick = () => (left-- > 0 ? requestAnimationFrame(tick) : done());
        tick();
      }),
  );
  const png = await page.locator("#canvas").screenshot();
  if (name) writeFileSync(name, png);
  return png.toString("base64");
}

// Share of the pixels of two pictures of one size that differ visibly.
const difference = (a, b) =>
  scratch.evaluate(
    async ([first, second]) => {
      const pixels = async (png) => {
        const image = new Image();
        image.src = `data:image/png;base64,${png}`;
        await image.decode();
        const canvas = new OffscreenCanvas(image.width, image.height);
        const pen = canvas.getContext("2d");
        pen.drawImage(image, 0, 0);
        return pen.getImageData(0, 0, image.width, image.height).data;
      };
      const [p, q] = [await pixels(first), await pixels(second)];
      if (p.length !== q.length) return 1;
      let differing = 0;
      for (let i = 0; i < p.length; i += 4) {
        const off = [0, 1, 2].some((c) => Math.abs(p[i + c] - q[i + c]) > 12);
        differing += off ? 1 : 0;
      }
      return differing / (p.length / 4);
    },
    [a, b],
  );

// Distance of two sRGB colors (0 to 1) in CIE Lab: 2 is just seen, 20 is another color.
function colorDistance(a, b) {
  const lab = (rgb) => {
    const [r, g, bl] = rgb.map((c) => (c > 0.04045 ? ((c + 0.055) / 1.055) ** 2.4 : c / 12.92));
    const f = (t) => (t > 216 / 24389 ? Math.cbrt(t) : (t * 24389) / 27 / 116 + 16 / 116);
    const [x, y, z] = [
      f((0.4124 * r + 0.3576 * g + 0.1805 * bl) / 0.9505),
      f(0.2126 * r + 0.7152 * g + 0.0722 * bl),
      f((0.0193 * r + 0.1192 * g + 0.9505 * bl) / 1.089),
    ];
    return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
  };
  const [p, q] = [lab(a), lab(b)];
  return Math.hypot(...p.map((value, k) => value - q[k]));
}

// Triangles of a rigid mesh of the page that share an edge, each pair with the angle between the
// faces and the greatest angle between their normals at the edge's ends, degrees.
const edgesOf = (page, part) =>
  page.evaluate((name) => {
    const { geometry } = window.holdfast.player.actors[0][name];
    const { position, normal } = geometry.attributes;
    const index = geometry.index?.array ?? Array.from({ length: position.count }, (_, k) => k);
    const at = (attribute, k) => [attribute.getX(k), attribute.getY(k), attribute.getZ(k)];
    const minus = (a, b) => a.map((value, k) => value - b[k]);
    const cross = (a, b) => [0, 1, 2].map((k) => a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3]);
    const angle = (a, b) => {
      const dot = a.reduce((sum, value, k) => sum + value * b[k], 0);
      return (Math.acos(Math.max(-1, Math.min(1, dot / Math.hypot(...a) / Math.hypot(...b)))) * 180) / Math.PI;
    };
    const sides = new Map(); // of an edge, by the places of its ends
    for (let f = 0; f < index.length; f += 3) {
      const ids = [index[f], index[f + 1], index[f + 2]];
      const [a, b, c] = ids.map((id) => at(position, id));
      const face = cross(minus(b, a), minus(c, a));
      if (Math.hypot(...face) < 1e-9) continue;
      for (let k = 0; k < 3; ++k) {
        const ends = [ids[k], ids[(k + 1) % 3]].map((id) => [at(position, id).join(), at(normal, id)]);
        ends.sort((p, q) => (p[0] < q[0] ? -1 : 1));
        const key = ends.map(([place]) => place).join();
        sides.set(key, [...(sides.get(key) ?? []), { face, normals: ends.map(([, n]) => n) }]);
      }
    }
    return [...sides.values()]
      .filter((pair) => pair.length === 2)
      .map(([p, q]) => ({
        bend: angle(p.face, q.face),
        step: Math.max(...p.normals.map((n, k) => angle(n, q.normals[k]))),
        lean: Math.max(...[p, q].flatMap(({ face, normals }) => normals.map((n) => angle(n, face)))),
      }));
  }, part);

// What is written in elements and does not fit into them, or reaches out of the window.
const cutTexts = (page) =>
  page.evaluate(() =>
    [...document.querySelectorAll("h1, h2, button, dt, dd, th, td, summary, .name, .values, .legend, .legend span, .readout, .notes li")]
      .filter((node) => node.checkVisibility())
      .filter((node) => {
        const box = node.getBoundingClientRect();
        const within = node.closest(".scroll") || (box.left >= -1 && box.right <= innerWidth + 1);
        return !within || node.scrollWidth > Math.ceil(box.width) + 1;
      })
      .map((node) => `${node.className || node.tagName}: ${node.textContent}`),
  );

async function changes(page, what, action, least = 0.0005) {
  const before = await picture(page);
  await action();
  const share = await difference(before, await picture(page));
  assert.ok(share > least, `${what} changes the picture (${(100 * share).toFixed(3)} % of it)`);
}

const tests = {
  async "shows the body model's surface"() {
    const page = await open("one.html");
    console.log(`  loaded in ${page.loadMs} ms`);
    const { count, worst } = await page.evaluate(() => {
      const { player, header } = window.holdfast;
      const { check } = header.clips[0];
      const errors = check.map(([frame, vertex, ...expected]) => {
        const at = player.vertex(frame, vertex);
        return Math.hypot(...at.map((value, k) => value - expected[k]));
      });
      return { count: errors.length, worst: Math.max(...errors) };
    });
    console.log(`  ${count} vertices within ${(1e3 * worst).toFixed(3)} mm of the body model`);
    assert.ok(count >= 100);
    assert.ok(worst < 0.0002, `off by ${worst} m`);
    // Without the actors the stage is empty; with them it is not.
    const shown = await picture(page, "report_front.png");
    await page.evaluate(() => {
      const { player } = window.holdfast;
      player.actors[0].group.visible = false;
      player.stage.invalidate();
    });
    assert.ok((await difference(shown, await picture(page))) > 0.02, "body and object are seen");
    await page.screenshot({ path: "report_desktop.png", fullPage: true });
    await close(page);
  },

  async "plays, and stops"() {
    const page = await open("one.html");
    assert.equal(await frameOf(page), 0, "waits, for those who asked for less motion");
    await page.keyboard.press("Space");
    await page.waitForFunction(() => window.holdfast.player.playback.frame > 5);
    assert.equal(await page.getAttribute("#play", "aria-label"), "Pause");
    await page.keyboard.press("Space");
    const stopped = await frameOf(page);
    await page.waitForTimeout(300);
    assert.equal(await frameOf(page), stopped);
    await close(page);
    const moving = await open("one.html", { reducedMotion: "no-preference" });
    await moving.waitForFunction(() => window.holdfast.player.playback.frame > 2);
    await close(moving);
  },

  async "gives the keys back after a click"() {
    const page = await open("one.html");
    const playing = () => page.evaluate(() => window.holdfast.player.playback.playing);
    await page.keyboard.press("Space");
    for (const id of ["[data-view=side]", "#wireframe", "#loop", "[data-colors=penetration]"]) {
      const button = page.locator(id);
      await button.click();
      const pressed = await button.getAttribute("aria-pressed");
      await page.keyboard.press("Space");
      assert.equal(await playing(), false, `space pauses after a click on ${id}`);
      assert.equal(await button.getAttribute("aria-pressed"), pressed, `and leaves ${id} alone`);
      await page.keyboard.press("Space");
    }
    // Who came by keyboard presses the button with it.
    await page.keyboard.press("Space");
    await page.locator("#loop").focus();
    await page.keyboard.press("Tab");
    await page.keyboard.press("Shift+Tab");
    await page.keyboard.press("Space");
    assert.equal(await page.getAttribute("#loop", "aria-pressed"), "true");
    assert.equal(await playing(), false);
    await close(page);
  },

  async "shades objects and tables smoothly up to their creases"() {
    const page = await open("take.html");
    for (const [part, creased] of [
      ["object", 60],
      ["furniture", 12],
    ]) {
      const edges = await edgesOf(page, part);
      const sharp = edges.filter(({ bend }) => bend > 60);
      const smooth = edges.filter(({ bend }) => bend < 20);
      console.log(`  ${part}: ${smooth.length} smooth edges, ${sharp.length} sharp ones`);
      assert.ok(smooth.length > 0 && sharp.length >= creased, "has both kinds");
      const step = Math.max(...smooth.map((edge) => edge.step));
      assert.ok(step < 0.1, `normals agree across a smooth edge (${step} degrees)`);
      const split = sharp.filter((edge) => edge.step > 30).length;
      assert.ok(split > 0.95 * sharp.length, `creases stay (${split} of ${sharp.length})`);
      const lean = Math.max(...edges.map((edge) => edge.lean));
      assert.ok(lean < 60, `no normal leans far from its face (${lean} degrees)`);
    }
    await page.keyboard.press("3");
    await seek(page, 100);
    await picture(page, "report_take.png");
    await close(page);
  },

  async "tells contact, object and skin apart by color"() {
    const page = await open("one.html");
    const { object, skin, contact } = await page.evaluate(() => {
      const { player } = window.holdfast;
      const actor = player.actors[0];
      const style = (color) => {
        const plain = color.getHexString(); // sRGB
        return [0, 2, 4].map((k) => parseInt(plain.slice(k, k + 2), 16) / 255);
      };
      const of = (table, k) => {
        const color = actor.object.material.color.clone();
        return style(color.setRGB(table[3 * k], table[3 * k + 1], table[3 * k + 2]));
      };
      const within = Math.floor(10 * player.scales.threshold) - 1; // tenths of a millimeter
      return {
        object: style(actor.object.material.color),
        skin: of(actor.table, 254),
        contact: Array.from({ length: within + 1 }, (_, mm) => of(actor.table, 127 + mm)),
      };
    });
    assert.ok(object[2] > object[0] + 0.2, "the object is blue");
    assert.ok(colorDistance(object, skin) > 20, `object and skin: ${colorDistance(object, skin)}`);
    for (const color of contact) {
      assert.ok(colorDistance(object, color) > 30, `object and contact: ${colorDistance(object, color)}`);
    }
    assert.ok(colorDistance(contact[0], skin) > 50);
    await close(page);
  },

  async "says in words what does not change, and nothing in keys"() {
    for (const file of ["one.html", "take.html"]) {
      const page = await open(file);
      const texts = (selector) => page.locator(selector).allTextContents();
      const drawn = await texts(".chart .name");
      const constant = new Map();
      for (const row of await page.locator("#constants > div").all()) {
        const [title, value] = [row.locator("dt"), row.locator("dd")];
        constant.set(await title.textContent(), await value.textContent());
      }
      console.log(`  ${[...constant].map((entry) => entry.join(": ")).join("; ")}`);
      for (const title of constant.keys()) assert.ok(!drawn.includes(title), `${title} is not drawn`);
      if (file === "one.html") assert.equal(constant.get("Wrist offset"), "zero throughout");
      const ranges = await page.evaluate(() =>
        window.holdfast.player.curves.charts.map(({ spec, lines }) => {
          const all = lines.map(({ values }) => values.filter(Number.isFinite));
          return [spec.title, Math.max(...all.map((v) => Math.max(...v) - Math.min(...v)))];
        }),
      );
      for (const [title, range] of ranges) assert.ok(range > 1e-12, `${title} is a curve`);
      const words = [...drawn, ...constant.keys(), ...(await texts("tbody th"))];
      assert.ok(words.length > 20);
      for (const text of words) {
        const plain = text.replace(/ E_[dct]$/, ""); // the paper's symbols
        assert.doesNotMatch(plain, /_|\b(mm|cm|cm3|m|m2|m s|s2|ms|deg|rad|ratio|lambda)\b/);
      }
      await close(page);
    }
  },

  async "shows texts whole"() {
    for (const file of ["one.html", "two.html", "take.html", "motion.html"]) {
      for (const viewport of [
        { width: 1440, height: 900 },
        { width: 820, height: 1180 },
        { width: 390, height: 844 },
      ]) {
        const page = await open(file, { viewport });
        assert.deepEqual(await cutTexts(page), [], `${file} at ${viewport.width} pixels`);
        await close(page);
      }
    }
  },

  async "folds long notes"() {
    const page = await open("one.html");
    await page.evaluate(() => {
      const { player } = window.holdfast;
      player.clip.notes = ["Short.", "word ".repeat(60)];
      player.showTexts();
    });
    const notes = page.locator("#notes li");
    assert.equal(await notes.count(), 2);
    for (const note of await notes.all()) {
      assert.ok((await note.boundingBox()).height < 40, "takes a line");
    }
    await page.locator("#notes summary").click();
    assert.ok((await notes.nth(1).innerText()).replaceAll("\n", "").length > 290, "says it all when asked");
    await close(page);
  },

  async "ties slider, curves and picture together"() {
    const page = await open("one.html");
    const cursor = () => page.locator(".chart .cursor").first().boundingBox();
    const before = await cursor();
    await changes(page, "scrubbing", () => page.locator("#scrub").fill("60"));
    assert.equal(await frameOf(page), 60);
    const after = await cursor();
    assert.ok(after.x > before.x + 40, "the cursor moves along");
    assert.match(await page.getAttribute("#scrub", "aria-valuetext"), /frame 61 of 145/);
    const plot = page.locator(".chart .plot").nth(1);
    await plot.scrollIntoViewIfNeeded();
    const box = await plot.boundingBox();
    await page.mouse.click(box.x + box.width - 12, box.y + box.height / 2);
    assert.ok((await frameOf(page)) > 140, "a click on a curve seeks");
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    assert.ok(await page.locator("#curves.hovering").count(), "hovering reads values");
    const titles = await page.locator(".chart .name").allTextContents();
    for (const title of ["Penetration depth", "Total energy"]) {
      assert.ok(titles.includes(title), `${title} is drawn`);
    }
    await close(page);
  },

  async "obeys the keyboard"() {
    const page = await open("one.html");
    const press = (key) => page.keyboard.press(key);
    await press("End");
    assert.equal(await frameOf(page), 144);
    await press("ArrowLeft");
    await press("Shift+ArrowLeft");
    assert.equal(await frameOf(page), 133);
    await press("Home");
    await press("ArrowRight");
    assert.equal(await frameOf(page), 1);
    await press(".");
    assert.equal(await page.inputValue("#speed"), "1.5");
    await seek(page, 40);
    await changes(page, "wireframe", () => press("w"), 0.005);
    await press("w");
    await changes(page, "the side view", () => press("2"), 0.01);
    await changes(page, "the hand's view", () => press("3"), 0.02);
    await changes(page, "the see-through object", () => press("o"), 0.005);
    await picture(page, "report_hand.png");
    await changes(page, "another coloring", () => press("c"));
    await changes(page, "no coloring", () => press("c"));
    await press("f");
    assert.equal(await page.getAttribute("#follow", "aria-pressed"), "false");
    await press("l");
    assert.equal(await page.getAttribute("#loop", "aria-pressed"), "false");
    await press("?");
    assert.ok(await page.locator("#help[open]").count());
    await press("Escape");
    assert.equal(await page.locator("#help[open]").count(), 0);
    // Everything is reached with the tab key, and seen to be.
    const reached = new Set();
    for (let k = 0; k < 30; ++k) {
      await press("Tab");
      const [id, outline] = await page.evaluate(() => {
        const { activeElement: at } = document;
        return [at.id || at.textContent, getComputedStyle(at).outlineStyle];
      });
      reached.add(id);
      if (id === "play") assert.notEqual(outline, "none", "the focus is visible");
    }
    for (const id of ["canvas", "play", "scrub", "speed", "Front", "Contact", "wireframe"]) {
      assert.ok(reached.has(id), `${id} is reached by keyboard`);
    }
    await close(page);
  },

  async "turns and zooms"() {
    const page = await open("one.html");
    const box = await page.locator("#canvas").boundingBox();
    const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
    await changes(page, "dragging", async () => {
      await page.mouse.move(x, y);
      await page.mouse.down();
      await page.mouse.move(x + 160, y, { steps: 4 });
      await page.mouse.up();
    }, 0.01);
    await changes(page, "the wheel", async () => {
      await page.mouse.wheel(0, -600);
      await page.waitForTimeout(200);
    }, 0.01);
    await close(page);
  },

  async "compares two clips"() {
    const page = await open("two.html");
    assert.equal(await page.getAttribute("#ghost", "aria-pressed"), "true");
    await seek(page, 30);
    await page.keyboard.press("3");
    await picture(page, "report_compare.png");
    await changes(page, "the ghost", () => page.keyboard.press("g"), 0.003);
    await page.keyboard.press("g");
    const caption = await page.locator(".chart .values").first().textContent();
    assert.match(caption, /\(/, "the ghost's value stands beside the clip's");
    await page.selectOption("#pick-clip", "1");
    await page.waitForFunction(() => window.holdfast.player.primary === 1);
    assert.equal(await page.inputValue("#pick-ghost"), "0", "they change places");
    await close(page);
    const three = await open("three.html");
    assert.equal(await three.inputValue("#pick-ghost"), "", "no ghost unless asked for");
    await changes(three, "another clip", async () => {
      await three.selectOption("#pick-clip", "2");
      await three.waitForFunction(() => window.holdfast.player.actors[2]);
    });
    await close(three);
  },

  async "shows motion without an object"() {
    const page = await open("motion.html");
    assert.ok(await page.locator("#color-group").isHidden());
    assert.ok(await page.locator("#legend").isHidden());
    assert.ok((await page.locator(".chart").count()) >= 1);
    await page.keyboard.press("c");
    await page.keyboard.press("o");
    await page.keyboard.press("g");
    await close(page);
  },

  async "edits the contacts of a transfer to a robot"() {
    const page = await open("robot/report.html");
    const json = (path) => JSON.parse(readFileSync(path, "utf8"));
    const written = json("robot/contacts.json");
    const rows = page.locator("#contacts tr");
    const save = async () => {
      const [download] = await Promise.all([page.waitForEvent("download"), page.click("#save")]);
      assert.equal(download.suggestedFilename(), "contacts.json");
      await download.saveAs("contacts.json");
      return json("contacts.json");
    };
    const drag = async ([x, y], [toX, toY]) => {
      await page.mouse.move(x, y);
      await page.mouse.down();
      await page.mouse.move(toX, toY, { steps: 5 });
      await page.mouse.up();
    };
    // Where the selected contact's spheres are, and the free parts of the robot that are seen.
    const places = () =>
      page.evaluate(() => {
        const { editor } = window.holdfast;
        const { view, header } = editor;
        const { object, hand } = editor.marked().find(({ large }) => large);
        const parts = header.parts.map(({ name, on_robot }, part) => {
          const at = view.pixel(view.centers[name]);
          const hit = view.hit(at, view.hand);
          const taken = editor.contacts.some((contact) => contact.part === name);
          return { name, at, free: on_robot && !taken && editor.arrays.hand_part[hit?.face.a] === part };
        });
        return { object: view.pixel(object), hand: view.pixel(hand), free: parts.filter(({ free }) => free) };
      });
    assert.equal(await rows.count(), written.contacts.length);
    assert.deepEqual(await save(), written, "nothing is changed yet");

    await page.locator("#canvas").scrollIntoViewIfNeeded();
    await rows.first().locator("button").first().click();
    // Straight onto the contact: elsewhere a few pixels may be centimeters of the object.
    await page.evaluate(() => {
      const { contacts, view } = window.holdfast.editor;
      const { camera, controls } = view.stage;
      controls.target.fromArray(contacts[0].point);
      camera.position.fromArray(contacts[0].point.map((x, k) => x + 0.4 * contacts[0].normal[k]));
    });
    await picture(page, "report_contacts.png");
    const { object } = await places();
    await drag(object, [object[0] + 10, object[1] + 8]);
    const moved = await save();
    const away = (a, b) => Math.hypot(...a.point.map((x, k) => x - b.point[k]));
    const distance = away(moved.contacts[0], written.contacts[0]);
    console.log(`  ${written.contacts[0].part} is moved by ${(1e3 * distance).toFixed(1)} mm`);
    assert.ok(distance > 5e-4 && distance < 0.04, "moved along the surface");
    assert.ok(Math.abs(Math.hypot(...moved.contacts[0].normal) - 1) < 1e-6);
    assert.match(await rows.first().textContent(), new RegExp(`${(1e3 * distance).toFixed(1)} mm`));
    const others = (file) => ({ ...file, contacts: file.contacts.slice(1) });
    assert.deepEqual(others(moved), others(written));

    const { hand, free } = await places();
    assert.ok(free.length > 0, "a part without a contact is seen");
    await drag(hand, free[0].at);
    const other = await save();
    assert.equal(other.contacts[0].part, free[0].name);
    assert.deepEqual(other.contacts[0].point, moved.contacts[0].point);

    const box = await page.locator("#canvas").boundingBox();
    await changes(page, "dragging beside the spheres", () =>
      drag([box.x + 20, box.y + box.height - 20], [box.x + 150, box.y + box.height - 40]), 0.01);
    await changes(page, "the wheel", async () => {
      await page.mouse.wheel(0, 300);
      await page.waitForTimeout(200);
    }, 0.01);
    assert.deepEqual(await save(), other, "the view is no contact");

    await page.click("#add");
    await page.click("#add");
    assert.equal(await rows.count(), written.contacts.length + 2);
    assert.match(await rows.last().textContent(), /new/);
    await page.evaluate(() => {
      const { editor } = window.holdfast;
      editor.contacts.at(-1).part = editor.contacts[0].part;
      editor.draw();
    });
    assert.ok(await page.locator("#save").isDisabled(), "a part has one contact at a time");
    assert.match(await page.textContent("#problem"), /two contacts/);
    for (let k = 0; k < 2; ++k) await rows.last().getByText("Remove").click();
    assert.deepEqual(await save(), other);
    // The command shown uses the file.
    const command = await page.textContent("#command");
    assert.ok([0, 3].includes(spawnSync("sh", ["-c", `${command} -f -q`]).status), command);
    const used = json("edited/contacts.json").contacts.find(({ part }) => part === free[0].name);
    assert.ok(away(used, other.contacts[0]) < 1e-3, "the robot is asked to keep the contact");
    assert.equal(json("edited/metrics.json").options.contacts, "contacts.json");

    await page.click("#reset");
    assert.deepEqual(await save(), written, "as it was");
    await close(page);
  },

  async "takes names from files as text"() {
    const page = await open("hostile.html");
    assert.equal(await page.evaluate(() => window.hacked), undefined);
    const told = "</script><script>window.hacked=1</script>&amp;<b>";
    assert.equal(await page.textContent("#title"), told);
    assert.equal(await page.title(), told);
    await close(page);
  },

  async "fits a phone"() {
    for (const file of ["one.html", "two.html"]) {
      const page = await open(file, {
        viewport: { width: 390, height: 844 },
        hasTouch: true,
        isMobile: true,
        deviceScaleFactor: 2,
        colorScheme: "dark",
      });
      const wide = await page.evaluate(() => document.documentElement.scrollWidth);
      assert.ok(wide <= 390, `no sideways scrolling (${wide} px)`);
      const small = await page.evaluate(() =>
        [...document.querySelectorAll("main button, main select, main input, .pickers select")]
          .map((node) => [node.id || node.textContent, node.getBoundingClientRect()])
          .filter(([, box]) => box.width > 0 && (box.height < 44 || box.width < 44))
          .map(([name, box]) => `${name} ${box.width} x ${box.height}`),
      );
      assert.deepEqual(small, [], "everything is large enough to touch");
      await changes(page, "a touched button", () => page.locator("[data-view=right]").tap(), 0.02);
      // The picture stays in sight beside the curves.
      await page.locator(".chart").nth(3).scrollIntoViewIfNeeded();
      const stage = await page.locator("#stage").boundingBox();
      assert.ok(stage.y >= -1 && stage.y < 10, "the stage stays at the top");
      await page.screenshot({ path: `report_phone_${file.replace(".html", ".png")}` });
      await close(page);
    }
  },
};

let failed = 0;
for (const [name, test] of Object.entries(tests)) {
  if (!name.includes(process.argv[3] ?? "")) continue;
  try {
    await test();
    console.log(`ok      ${name}`);
  } catch (error) {
    ++failed;
    console.log(`FAILED  ${name}\n${error.stack}`);
  }
}
await browser.close();
process.exit(failed === 0 ? 0 : 1);
