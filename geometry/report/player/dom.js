// SPDX-License-Identifier: MIT

// An element with attributes and children. Texts go in as text: nothing from a file becomes markup.
export function element(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  node.append(...children.filter((child) => child !== ""));
  return node;
}

export const find = (id) => document.getElementById(id);
