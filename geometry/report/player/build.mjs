// SPDX-License-Identifier: MIT
// node build.mjs NODE_MODULES OUTPUT: style, markup and script as one page that needs nothing else.
import { readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const [modules, output] = process.argv.slice(2);
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

const script = await bundle("player.js", { format: "iife", target: ["es2021"] });
const style = await bundle("report.css", { target: ["chrome100", "firefox113", "safari16.4"] });
// Functions as replacements: a bundle may hold "$&", which replace() would expand.
const page = readFileSync(join(here, "report.html"), "utf8")
  .replace("<!--holdfast:style-->", () => `<style>${style}</style>`)
  .replace("<!--holdfast:script-->", () => `<script>${script}</script>`);
writeFileSync(output, page);
