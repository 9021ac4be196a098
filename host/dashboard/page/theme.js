/** @file Light or dark: as the system says, or as the person has chosen here. */

const KEY = "codewheel-theme";
const THEMES = ["auto", "light", "dark"];

/** Lets a button go round the themes. The choice is remembered in this browser. */
export function installTheme(button) {
  let theme = remembered();
  const apply = () => {
    if (theme === "auto") delete document.documentElement.dataset.theme;
    else document.documentElement.dataset.theme = theme;
    button.textContent = `Theme: ${theme}`;
  };
  button.addEventListener("click", () => {
    theme = THEMES[(THEMES.indexOf(theme) + 1) % THEMES.length];
    remember(theme);
    apply();
  });
  apply();
}

function remembered() {
  try {
    const theme = localStorage.getItem(KEY);
    return THEMES.includes(theme) ? theme : "auto";
  } catch {
    return "auto";
  }
}

function remember(theme) {
  try {
    localStorage.setItem(KEY, theme);
  } catch {
    // Where nothing may be kept, the choice lasts as long as the page.
  }
}
