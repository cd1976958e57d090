// The light and the dark theme.

/** The current colours of the page, and the colour of each method. */
export function colours(methods) {
  const style = getComputedStyle(document.documentElement);
  const probe = document.createElement("i");
  document.body.append(probe);
  // Assigning the variable to an element resolves light-dark() to the colour of the current theme.
  const value = (name) => {
    probe.style.color = style.getPropertyValue(`--${name}`);
    return getComputedStyle(probe).color;
  };
  const names = ["ground", "panel", "ink", "pale", "line", "accent"];
  const theme = Object.fromEntries(names.map((name) => [name, value(name)]));
  probe.remove();
  theme.methods = Object.fromEntries(methods.map((method) => [method.name, method.colour]));
  return theme;
}

/** Switches between the light and the dark theme. */
export function switchTheme() {
  const root = document.documentElement;
  const dark = matchMedia("(prefers-color-scheme: dark)").matches;
  const now = root.dataset.theme ?? (dark ? "dark" : "light");
  root.dataset.theme = now === "dark" ? "light" : "dark";
}
