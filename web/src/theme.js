// Light and dark.

/** The colours of the page as they are now, and those of the methods. */
export function colours(methods) {
  const style = getComputedStyle(document.documentElement);
  const probe = document.createElement("i");
  document.body.append(probe);
  // The colour that light-dark() chooses.
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

/** From light to dark, and back. */
export function switchTheme() {
  const root = document.documentElement;
  const dark = matchMedia("(prefers-color-scheme: dark)").matches;
  const now = root.dataset.theme ?? (dark ? "dark" : "light");
  root.dataset.theme = now === "dark" ? "light" : "dark";
}
