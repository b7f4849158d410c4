// SPDX-License-Identifier: MIT
// node show_report.mjs CHROMIUM: uses the reports beside this file as a person would, and checks what
// is seen. Leaves screenshots.
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
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
    assert.ok(page.loadMs < 20000, "loads in reasonable time even on a busy machine");
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
    for (const title of ["Skin in contact", "Penetration depth", "Total energy", "Solve time"]) {
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
    await changes(page, "another colouring", () => press("c"));
    await changes(page, "no colouring", () => press("c"));
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
    assert.ok(await page.locator("#colour-group").isHidden());
    assert.ok(await page.locator("#legend").isHidden());
    assert.ok((await page.locator(".chart").count()) >= 1);
    await page.keyboard.press("c");
    await page.keyboard.press("o");
    await page.keyboard.press("g");
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
