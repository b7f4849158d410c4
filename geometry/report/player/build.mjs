// SPDX-License-Identifier: MIT
// node build.mjs NODE_MODULES PLAYER CONTACTS: writes the player's page, and the section of a page
// that edits contacts; each has its style, markup and script and needs nothing else.
import { readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const [modules, player, contacts] = process.argv.slice(2);
const here = dirname(fileURLToPath(import.meta.url));
const esbuild = createRequire(join(modules, "modules.js"))("esbuild");

const bundle = async (entry, options) => {
  const result = await esbuild.build({
    entryPoints: [join(here, entry)],
    bundle: true,
    minify: true,
    write: false,
    charset: "utf8",
    nodePaths: [modules],
    legalComments: "inline", // three.js asks for its license line to stay
    logLevel: "warning",
    ...options,
  });
  return result.outputFiles[0].text;
};

// Functions as replacements: a bundle may hold "$&", which replace() would expand.
const write = async (output, markup, entry, rules) => {
  const script = await bundle(entry, { format: "iife", target: ["es2021"] });
  const style = await bundle(rules, { target: ["chrome100", "firefox113", "safari16.4"] });
  const page = readFileSync(join(here, markup), "utf8")
    .replace("<!--holdfast:style-->", () => `<style>${style}</style>`)
    .replace("<!--holdfast:script-->", () => `<script>${script}</script>`);
  writeFileSync(output, page);
};
await write(player, "report.html", "player.js", "report.css");
await write(contacts, "contacts.html", "contacts.js", "contacts.css");
