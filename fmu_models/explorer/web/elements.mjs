// Elements of a page, found and made, and its colours.

export const element = (id) => document.getElementById(id);
export const make = (name, attributes = {}, ...children) => {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (value !== null && value !== undefined) made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
};

export function palette() {
  const style = getComputedStyle(document.documentElement);
  return Object.fromEntries(["ground", "ink", "line", "faint", "hold", "mark", "plus", "minus", "k0", "k1", "k2", "k3"].map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}
