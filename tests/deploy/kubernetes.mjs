// Holds Kubernetes objects to the schemas of its API: kubernetes.mjs NODE_MODULES, objects as a JSON array on standard
// input, complaints as a JSON array on standard output. What the schemas let pass and API servers only warn of, a field
// that does not exist, is a complaint too.
import { pathToFileURL } from "node:url";
import { readFileSync } from "node:fs";

async function schemaOf({ apiVersion, kind }) {
  const group = apiVersion.startsWith("monitoring.coreos.com/") ? "@kubernetes-models/prometheus-operator" : "kubernetes-models";
  return (await import(pathToFileURL(`${process.argv[2]}/${group}/${apiVersion}/${kind}.js`)))[kind];
}

// The same object; `unread` gets to know of each field whether anybody looked at it.
function watched(value, path, unread) {
  if (value === null || typeof value !== "object") return value;
  const copy = Array.isArray(value) ? [] : {};
  for (const [name, child] of Object.entries(value)) {
    unread.add(`${path}/${name}`);
    copy[name] = watched(child, `${path}/${name}`, unread);
  }
  return new Proxy(copy, {
    get(target, name) {
      unread.delete(`${path}/${String(name)}`);
      return target[name];
    },
  });
}

const complaints = [];
for (const object of JSON.parse(readFileSync(0, "utf8"))) {
  const name = `${object.kind} ${object.metadata?.name}`;
  try {
    const schema = await schemaOf(object);
    const unread = new Set();
    Object.setPrototypeOf(watched(object, "", unread), schema.prototype).validate();
    for (const path of unread) complaints.push(`${name}: ${path} is not in the schema`);
  } catch (error) {
    complaints.push(`${name}: ${error.message}`);
  }
}
console.log(JSON.stringify(complaints));
