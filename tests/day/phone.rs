//! A phone with the rig's page: taps, what is read there, and pictures of it.

use std::path::PathBuf;
use std::time::Duration;
use std::{env, fs};

use relit_tests::chromium::Chromium;
use serde_json::Value;

/// Pixels of the screen, and the variable that gives others, as in 844x390.
const SCREEN: (u32, u32) = (390, 844);
const OTHER_SCREEN: &str = "RELIT_SCREEN";
/// The folder of the pictures, where they are wanted.
const PICTURES: &str = "RELIT_PICTURES";
/// What hangs over a side of the screen, or has more text than place.
const CUT_OFF: &str = "[...document.querySelectorAll('body *')].filter((part) => { \
    const box = part.getBoundingClientRect(); \
    if (!part.checkVisibility({ visibilityProperty: true }) || box.width === 0 || part.closest('.away, datalist')) return false; \
    const over = box.left < -1 || box.right > innerWidth + 1; \
    const tight = ['BUTTON', 'A', 'DD'].includes(part.tagName) && part.scrollWidth > part.clientWidth + 1 && part.clientWidth > 0; \
    return over || tight; }).map((part) => `${part.tagName} ${part.id}: ${part.textContent.slice(0, 40)}`).join('; ')";

/// Gives everything at once the colour that it is on its way to.
const FINISH: &str = "document.getAnimations().forEach((change) => change.finish())";

/// A button that makes room for another one under the first finger that touches it.
const MOVES: &str = "data:text/html,<meta name=viewport content=width=device-width> \
    <style>button { position: absolute; top: 0; width: 99px; height: 99px }</style> \
    <button id=other></button><button id=wanted></button> \
    <script>const met = []; \
        addEventListener('touchstart', () => { wanted.style.top = '300px' }); \
        for (const button of [wanted, other]) button.onclick = () => met.push(button.id)</script>";

/// A browser with a finger.
#[derive(Debug)]
pub(crate) struct Phone {
    page: Chromium,
    pictures: Option<PathBuf>,
    /// What the pictures' names begin with.
    name: &'static str,
    taken: usize,
}

impl Phone {
    pub(crate) fn open(browser: &PathBuf, url: &str, name: &'static str) -> Self {
        let pictures = env::var_os(PICTURES).map(PathBuf::from);
        if let Some(folder) = &pictures {
            fs::create_dir_all(folder).unwrap();
        }
        let mut page = Chromium::open(browser, url, screen(), true);
        page.wait_for("document.body?.className === '' && document.getElementById('phase').textContent !== ''");
        Self {
            page,
            pictures,
            name,
            taken: 0,
        }
    }

    pub(crate) fn page(&mut self) -> &mut Chromium {
        &mut self.page
    }

    pub(crate) fn tap(&mut self, selector: &str) {
        self.page.tap(selector);
    }

    /// Taps on a field and types into it.
    pub(crate) fn write(&mut self, selector: &str, text: &str) {
        self.page.tap(selector);
        self.wait_for(&format!(
            "document.activeElement === document.querySelector({selector:?})"
        ));
        self.page.type_text(text);
    }

    pub(crate) fn value(&mut self, expression: &str) -> Value {
        self.page.value(expression)
    }

    pub(crate) fn wait_for(&mut self, expression: &str) {
        self.page.wait_for(expression);
    }

    pub(crate) fn wait_so_long(&mut self, expression: &str, longest: Duration) {
        self.page.wait_so_long(expression, longest);
    }

    /// What stands in a part of the page.
    pub(crate) fn text(&mut self, selector: &str) -> String {
        let expression = format!("document.querySelector({selector:?}).textContent");
        self.value(&expression).as_str().unwrap().to_owned()
    }

    /// Waits until a part of the page is shown and has these words.
    pub(crate) fn wait_text(&mut self, selector: &str, words: &str) {
        self.wait_for(&has(selector, words));
    }

    /// The same, at most so long.
    pub(crate) fn wait_text_so_long(&mut self, selector: &str, words: &str, longest: Duration) {
        self.wait_so_long(&has(selector, words), longest);
    }

    /// Whether the button at the bottom has this text, and does something.
    pub(crate) fn wait_button(&mut self, text: &str, is_enabled: bool) {
        self.wait_for(&format!(
            "document.getElementById('go').textContent === {text:?} \
                && document.getElementById('go').disabled !== {is_enabled}"
        ));
    }

    /// Looks at the screen: nothing is cut off, and a picture is taken where pictures are wanted.
    pub(crate) fn see(&mut self, what: &str) {
        let cut_off = self.value(CUT_OFF);
        self.take(what, false);
        assert_eq!(cut_off, "", "cut off at: {what}");
    }

    /// Looks at the page that a tap opened, and closes it.
    pub(crate) fn look_into_opened(&mut self, what: &str, words: &str) {
        self.page.turn_to_opened();
        self.page
            .wait_for(&format!("document.body.innerText.includes({words:?})"));
        let over = self.value("document.documentElement.scrollWidth > innerWidth + 1");
        self.take(what, false);
        assert_eq!(over, false, "wider than the screen: {what}");
        self.page.close_opened();
    }

    fn take(&mut self, what: &str, whole: bool) {
        self.taken += 1;
        if let Some(folder) = &self.pictures {
            self.page.value(FINISH);
            let name = format!("{}-{:02}-{what}.jpg", self.name, self.taken);
            fs::write(folder.join(name), self.page.picture(whole)).unwrap();
        }
    }
}

pub(crate) fn a_tap_follows_what_moved_under_the_finger_and_meets_nothing_else(browser: PathBuf) {
    let mut page = Chromium::open(&browser, MOVES, SCREEN, true);
    page.tap("#wanted");
    assert_eq!(page.value("met.join(' ')"), "wanted");
}

fn screen() -> (u32, u32) {
    let other = env::var(OTHER_SCREEN).ok();
    let sides = other.as_deref().map(|sides| {
        let (width, height) = sides.split_once('x').unwrap();
        (width.parse().unwrap(), height.parse().unwrap())
    });
    sides.unwrap_or(SCREEN)
}

fn has(selector: &str, words: &str) -> String {
    format!(
        "(() => {{ const part = document.querySelector({selector:?}); \
            return Boolean(part?.checkVisibility() && part.textContent.includes({words:?})); }})()"
    )
}
