//! A headless Chromium, driven by its DevTools protocol over a pair of pipes.

use std::env;
use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use base64::prelude::{BASE64_STANDARD, Engine};
use serde_json::{Value, json};

const NAMES: [&str; 4] = [
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
];
/// It shows the page that is tested, and does nothing of its own accord.
const ARGUMENTS: [&str; 11] = [
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--disable-quic",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--hide-scrollbars",
    "--remote-debugging-pipe",
];
/// Longest wait for anything, unless told otherwise, on a machine that is busy with something else; all comes far
/// sooner.
const LONG: Duration = Duration::from_secs(300);
const PAUSE: Duration = Duration::from_millis(50);
/// After so long a tap counts as lost: it met something that takes none.
const LOST: Duration = Duration::from_secs(10);

/// A screen, and what it is touched with.
#[derive(Debug, Clone, Copy)]
struct Screen {
    width: u32,
    height: u32,
    is_phone: bool,
}

/// Catches the click of a tap before the page does, and notes whether it meets what is meant. If the page moved under the
/// finger, so that it meets something else, it does nothing there.
const CATCH_CLICKS: &str = "if (!window.tapped) { \
    window.tapped = {}; \
    addEventListener('click', (event) => { \
        const { meant } = window.tapped; \
        if (meant === undefined || !event.isTrusted) return; \
        const wanted = meant && document.querySelector(meant); \
        const met = Boolean(wanted && wanted.contains(event.target)); \
        window.tapped = { met }; \
        if (!met) { event.preventDefault(); event.stopImmediatePropagation(); } \
    }, true); }";

/// What the browser says about a page that gives way to another while it is asked.
const PAGE_IS_GOING: [&str; 2] = ["context", "navigated or closed"];

/// A browser with one page, and perhaps another that this one opened. Ends with its test, which fails by a panic
/// where the browser does not do what it is told.
#[derive(Debug)]
pub struct Chromium {
    child: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
    screen: Screen,
    /// The pages that opened each other, as target and session; the last one is in front.
    pages: Vec<(String, String)>,
    number: u64,
    _profile: tempfile::TempDir,
}

/// The browser's program, if there is one on this machine.
///
/// # Errors
/// Why a test is skipped where there is none.
pub fn find() -> Result<PathBuf, String> {
    let path = env::var_os("PATH").unwrap_or_default();
    let mut folders: Vec<PathBuf> = env::split_paths(&path).collect();
    folders.push("/Applications/Google Chrome.app/Contents/MacOS".into());
    let mut places = folders
        .iter()
        .flat_map(|folder| NAMES.map(|name| folder.join(name)));
    let found = places.find(|place| place.is_file());
    found.ok_or_else(|| "there is no Chromium or Chrome on the PATH".to_owned())
}

impl Chromium {
    /// Opens `url` on a screen of `width` x `height`; `phone` gives it a finger instead of a mouse.
    pub fn open(program: &PathBuf, url: &str, (width, height): (u32, u32), phone: bool) -> Self {
        let profile = tempfile::tempdir().unwrap();
        // The browser reads commands at 3 and answers at 4.
        let mut child = Command::new("sh")
            .args([
                "-c",
                r#"exec "$@" 3<&0 4>&1 0</dev/null 1>/dev/null 2>/dev/null"#,
                "sh",
            ])
            .arg(program)
            .args(ARGUMENTS)
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut browser = Self {
            to: child.stdin.take().unwrap(),
            from: BufReader::new(child.stdout.take().unwrap()),
            child,
            screen: Screen {
                width,
                height,
                is_phone: phone,
            },
            pages: Vec::new(),
            number: 0,
            _profile: profile,
        };
        let target = browser.ask_browser("Target.createTarget", json!({ "url": "about:blank" }));
        browser.attach(target["targetId"].as_str().unwrap());
        browser.call("Page.navigate", json!({ "url": url }));
        browser
    }

    /// Brings a page to the front.
    fn attach(&mut self, target: &str) {
        let attach = json!({ "targetId": target, "flatten": true });
        let session = self.ask_browser("Target.attachToTarget", attach);
        let session = session["sessionId"].as_str().unwrap().to_owned();
        self.pages.push((target.to_owned(), session));
        let Screen {
            width,
            height,
            is_phone,
        } = self.screen;
        let scale = if is_phone { 2 } else { 1 };
        self.call(
            "Emulation.setDeviceMetricsOverride",
            json!({ "width": width, "height": height, "deviceScaleFactor": scale, "mobile": is_phone }),
        );
        self.call(
            "Emulation.setTouchEmulationEnabled",
            json!({ "enabled": is_phone, "maxTouchPoints": 5 }),
        );
    }

    /// A command to the page in front, and its result.
    pub fn call(&mut self, method: &str, parameters: Value) -> Value {
        let (_, session) = self.pages.last().unwrap();
        let session = json!({ "sessionId": session });
        done(method, self.send(method, session, parameters))
    }

    fn ask_browser(&mut self, method: &str, parameters: Value) -> Value {
        done(method, self.send(method, json!({}), parameters))
    }

    /// The browser's answer, with `result` or `error`.
    fn send(&mut self, method: &str, mut command: Value, parameters: Value) -> Value {
        self.number += 1;
        command["id"] = json!(self.number);
        command["method"] = json!(method);
        command["params"] = parameters;
        self.to
            .write_all(format!("{command}\0").as_bytes())
            .unwrap();
        loop {
            let mut message = Vec::new();
            self.from.read_until(0, &mut message).unwrap();
            message.pop();
            let message: Value = serde_json::from_slice(&message)
                .unwrap_or_else(|_| panic!("the browser ended on {method}"));
            if message["id"] == self.number {
                return message;
            }
        }
    }

    /// The value of a JavaScript expression on the page.
    pub fn value(&mut self, expression: &str) -> Value {
        let value = self.value_now(expression);
        value.unwrap_or_else(|| panic!("there is no page to ask: {expression}"))
    }

    /// The same; `None` while one page gives way to another.
    fn value_now(&mut self, expression: &str) -> Option<Value> {
        let (_, session) = self.pages.last().unwrap();
        let session = json!({ "sessionId": session });
        let parameters = json!({ "expression": expression, "returnByValue": true });
        let answer = self.send("Runtime.evaluate", session, parameters);
        let error = answer["error"]["message"].as_str().unwrap_or_default();
        if PAGE_IS_GOING.iter().any(|sign| error.contains(sign)) {
            return None;
        }
        let result = done("Runtime.evaluate", answer);
        assert!(
            result["exceptionDetails"].is_null(),
            "{expression}: {}",
            result["exceptionDetails"]
        );
        Some(result["result"]["value"].clone())
    }

    /// Waits until an expression is true.
    pub fn wait_for(&mut self, expression: &str) {
        self.wait_so_long(expression, LONG);
    }

    /// Waits until an expression is true, at most so long.
    pub fn wait_so_long(&mut self, expression: &str, longest: Duration) {
        let began = Instant::now();
        while self.value_now(expression) != Some(Value::Bool(true)) {
            if began.elapsed() > longest {
                let text = self.value_now("document.body?.innerText");
                panic!("never came: {expression}; the page shows {text:?}");
            }
            sleep(PAUSE);
        }
    }

    /// Presses, moves through all places and lets go with the mouse.
    pub fn drag(&mut self, places: &[[f64; 2]]) {
        let last = places.len() - 1;
        self.mouse("mouseMoved", places[0], 0);
        self.mouse("mousePressed", places[0], 1);
        places[1..]
            .iter()
            .for_each(|&place| self.mouse("mouseMoved", place, 1));
        self.mouse("mouseReleased", places[last], 0);
    }

    fn mouse(&mut self, kind: &str, [x, y]: [f64; 2], buttons: u32) {
        let event = json!({ "type": kind, "x": x, "y": y, "button": "left", "buttons": buttons, "clickCount": 1 });
        self.call("Input.dispatchMouseEvent", event);
    }

    /// Moves as many fingers as each step has places.
    pub fn touch(&mut self, steps: &[Vec<[f64; 2]>]) {
        for (at, step) in steps.iter().enumerate() {
            let kind = if at == 0 { "touchStart" } else { "touchMove" };
            self.touched(kind, step);
        }
        self.touched("touchEnd", &[]);
    }

    fn touched(&mut self, kind: &str, places: &[[f64; 2]]) {
        let points: Vec<Value> = places
            .iter()
            .enumerate()
            .map(|(id, [x, y])| json!({ "x": x, "y": y, "id": id }))
            .collect();
        self.call(
            "Input.dispatchTouchEvent",
            json!({ "type": kind, "touchPoints": points }),
        );
    }

    /// Scrolls to what a person would touch and touches its middle with a finger, once it is there; again where the page
    /// moved meanwhile. Fails where it is not shown, stays disabled, or lies below something else.
    pub fn tap(&mut self, selector: &str) {
        let expression = format!(
            "(() => {{ {CATCH_CLICKS} \
                const wanted = document.querySelector({selector:?}); \
                if (!wanted) return 'is not there'; \
                if (wanted.disabled) return 'is disabled'; \
                wanted.scrollIntoView({{ block: 'center', behavior: 'instant' }}); \
                const box = wanted.getBoundingClientRect(); \
                if (box.width === 0 || box.height === 0) return 'is not shown'; \
                const place = [box.left + box.width / 2, box.top + box.height / 2]; \
                const found = document.elementFromPoint(...place); \
                if (!wanted.contains(found)) return `lies below ${{found?.id || found?.tagName}}`; \
                window.tapped = {{ meant: {selector:?} }}; \
                return place; }})()"
        );
        let began = Instant::now();
        loop {
            let place = self.value_now(&expression).unwrap_or_default();
            if let Ok(place) = serde_json::from_value(place.clone()) {
                self.touch(&[vec![place]]);
                if self.has_met() {
                    return;
                }
            }
            assert!(
                began.elapsed() < LONG,
                "{selector} cannot be tapped: it {place}"
            );
            sleep(PAUSE);
        }
    }

    /// Whether the click of a tap met what was meant. One that comes later than that meets nothing.
    fn has_met(&mut self) -> bool {
        let began = Instant::now();
        loop {
            let is_lost = began.elapsed() > LOST;
            let otherwise = if is_lost {
                "(window.tapped = { meant: '' }, false)"
            } else {
                "null"
            };
            let met = format!("window.tapped ? window.tapped.met ?? {otherwise} : true");
            match self.value_now(&met) {
                // The click has led to another page.
                None => return true,
                Some(Value::Bool(met)) => return met,
                Some(_) => sleep(PAUSE),
            }
        }
    }

    /// Types a text where the cursor is.
    pub fn type_text(&mut self, text: &str) {
        self.call("Input.insertText", json!({ "text": text }));
    }

    /// Takes back as many letters before the cursor.
    pub fn erase(&mut self, letters: usize) {
        for kind in ["rawKeyDown", "keyUp"].repeat(letters) {
            let event = json!({ "type": kind, "key": "Backspace", "code": "Backspace", "windowsVirtualKeyCode": 8 });
            self.call("Input.dispatchKeyEvent", event);
        }
    }

    /// Presses a key.
    pub fn key(&mut self, key: &str, modifiers: u32) {
        for kind in ["keyDown", "keyUp"] {
            let event = json!({ "type": kind, "key": key, "modifiers": modifiers });
            self.call("Input.dispatchKeyEvent", event);
        }
    }

    /// Clicks a button.
    pub fn click(&mut self, selector: &str) {
        self.value(&format!("document.querySelector({selector:?}).click()"));
    }

    /// Loads the page anew.
    pub fn reload(&mut self) {
        self.value("window.isOld = true");
        self.call("Page.reload", json!({}));
        self.wait_for("!window.isOld && document.readyState === 'complete'");
    }

    /// Turns to the page that the one in front has opened, once it is there.
    pub fn turn_to_opened(&mut self) {
        let began = Instant::now();
        loop {
            let targets = self.ask_browser("Target.getTargets", json!({}));
            let targets = targets["targetInfos"].as_array().unwrap().clone();
            let opener = self.pages.last().unwrap().0.clone();
            let opened = targets
                .iter()
                .find(|target| target["type"] == "page" && target["openerId"] == json!(opener));
            if let Some(opened) = opened {
                self.attach(opened["targetId"].as_str().unwrap());
                break;
            }
            assert!(began.elapsed() < LONG, "no page was opened: {targets:?}");
            sleep(PAUSE);
        }
        self.wait_for("document.readyState === 'complete' && location.href !== 'about:blank'");
    }

    /// Closes the page in front; the one that opened it is in front again.
    pub fn close_opened(&mut self) {
        let (target, _) = self.pages.pop().unwrap();
        self.ask_browser("Target.closeTarget", json!({ "targetId": target }));
    }

    /// What the screen shows, as a JPEG file; `whole`: the whole page.
    pub fn picture(&mut self, whole: bool) -> Vec<u8> {
        let parameters = json!({ "format": "jpeg", "quality": 88, "captureBeyondViewport": whole });
        let picture = self.call("Page.captureScreenshot", parameters);
        BASE64_STANDARD
            .decode(picture["data"].as_str().unwrap())
            .unwrap()
    }
}

/// What a command gave; fails where it gave an error.
fn done(method: &str, answer: Value) -> Value {
    assert!(answer["error"].is_null(), "{method}: {}", answer["error"]);
    answer["result"].clone()
}

impl Drop for Chromium {
    fn drop(&mut self) {
        // Its helpers go with it.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
