// Bundles main.js, three.js and the style into one HTML file that needs nothing else.
// Usage: node build.mjs SOURCE_DIR PAGE.html; esbuild and three are resolved from the folder that this file lies in.
import { readFileSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const [source, page] = process.argv.slice(2);
const here = dirname(fileURLToPath(import.meta.url));

const bundle = await build({
  entryPoints: [join(source, "main.js")],
  bundle: true,
  minify: true,
  write: false,
  format: "iife",
  target: "es2022",
  legalComments: "inline", // three.js is MIT: its notice travels with it
  nodePaths: [join(here, "node_modules")],
});
// An HTML parser ends a script at the first "</script", wherever it stands.
const script = bundle.outputFiles[0].text.replaceAll("</script", "<\\/script");
const parts = { SCRIPT: script, STYLE: readFileSync(join(source, "style.css"), "utf8") };
const template = readFileSync(join(source, "page.html"), "utf8");
writeFileSync(page, template.replace(/\{\{(SCRIPT|STYLE)\}\}/g, (_, name) => parts[name]));
