// The panel beside the picture: switches, facts, keys.

/** An element with text and children: text only, so that nothing in the data can become markup. */
export function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key === "style") Object.assign(made.style, value);
    else made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
}

/** A switch that shows and hides an object of the scene. */
export function addSwitch(stage, key, label, object, isOn = true) {
  object.visible = isOn;
  const box = element("input", { type: "checkbox", "data-shows": label.split(" ")[0].toLowerCase() });
  box.checked = isOn;
  box.addEventListener("change", () => {
    object.visible = box.checked;
    stage.render();
  });
  onKey(key, () => box.click());
  document.getElementById("toggles").append(element("label", { title: `key ${key}` }, box, label));
}

const actions = new Map();

/** One action a key; keys typed together with Ctrl, Alt or Meta are the browser's. */
export function onKey(key, action) {
  if (actions.size === 0) {
    document.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.altKey || event.metaKey || !actions.has(event.key)) return;
      if (event.target.type === "range" && event.key.startsWith("Arrow")) return; // the slider's own
      event.preventDefault();
      actions.get(event.key)();
    });
  }
  actions.set(key, action);
}

export function sayKeys(pairs) {
  for (const [keys, meaning] of pairs) {
    document.getElementById("keys").append(element("span", {}, element("kbd", {}, keys), ` ${meaning}`));
  }
}

/** Name and value, row by row. */
export function facts(pairs) {
  return element("dl", {}, ...pairs.flatMap(([name, value]) => [element("dt", {}, name), element("dd", { "data-fact": name }, value)]));
}

export function warn(sentences) {
  for (const sentence of sentences ?? []) document.getElementById("warnings").append(element("li", {}, sentence));
}
