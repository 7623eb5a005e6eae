// Tests every page of the built site with axe-core, light and dark, and that search works without a server.
// Needs Node, Chromium, and `npm install axe-core playwright-core` in the folder that it is started in:
//
//     mdbook build docs && node docs/axe.mjs target/site /usr/bin/chromium
import { createRequire } from "node:module";
import { readdirSync } from "node:fs";
import { resolve } from "node:path";
import { pathToFileURL } from "node:url";

const [site = "target/site", executablePath = "/usr/bin/chromium"] = process.argv.slice(2);
const require = createRequire(resolve("package.json"));
const { chromium } = require("playwright-core");
const axe = require.resolve("axe-core/axe.min.js");
const without = ["print.html", "404.html", "toc.html"];
const files = readdirSync(site, { recursive: true }).filter((name) => name.endsWith(".html") && !without.includes(name)).sort();
const browser = await chromium.launch({ executablePath, args: ["--no-sandbox"] });
let failures = 0;
const fail = (text) => {
    failures += 1;
    console.log(text);
};

for (const colorScheme of ["light", "dark"]) {
    const page = await browser.newPage({ colorScheme, viewport: { width: 1280, height: 900 } });
    for (const file of files) {
        await page.goto(pathToFileURL(resolve(site, file)).href);
        await page.addScriptTag({ path: axe });
        const { violations } = await page.evaluate(() => axe.run());
        for (const { id, nodes } of violations) {
            fail(`${file} (${colorScheme}): ${id}, ${nodes.length} times: ${nodes[0].html.slice(0, 160)}\n  ${nodes[0].failureSummary}`);
        }
        const wide = await page.evaluate(() => document.documentElement.scrollWidth > innerWidth);
        if (wide) fail(`${file}: wider than the window`);
    }
    await page.close();
}

const page = await browser.newPage();
await page.goto(`${pathToFileURL(resolve(site, "index.html")).href}?search=gauge`);
await page.waitForSelector("#mdbook-searchresults li, #searchresults li", { timeout: 10000 }).catch(() => fail("search finds nothing"));
await browser.close();
console.log(`${files.length} pages, light and dark: ${failures} failures`);
process.exit(failures ? 1 : 0);
