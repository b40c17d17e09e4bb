//! A headless Chromium, driven by its DevTools protocol over a pair of pipes.

use std::env;
use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

const NAMES: [&str; 4] = [
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
];
/// Longest wait for anything; all comes far sooner.
const LONG: Duration = Duration::from_secs(60);
const PAUSE: Duration = Duration::from_millis(50);

/// A browser with one page. Ends with its test.
pub(crate) struct Chromium {
    child: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
    session: String,
    number: u64,
    _profile: tempfile::TempDir,
}

/// The browser's program, if there is one on this machine.
pub(crate) fn find() -> Option<PathBuf> {
    let path = env::var_os("PATH")?;
    let mut folders: Vec<PathBuf> = env::split_paths(&path).collect();
    folders.push("/Applications/Google Chrome.app/Contents/MacOS".into());
    let places = folders
        .iter()
        .flat_map(|folder| NAMES.map(|name| folder.join(name)));
    places.into_iter().find(|place| place.is_file())
}

impl Chromium {
    /// Opens `url` on a screen of `width` x `height`; `phone` gives it a finger instead of a mouse.
    pub(crate) fn open(
        program: &PathBuf,
        url: &str,
        (width, height): (u32, u32),
        phone: bool,
    ) -> Self {
        let profile = tempfile::tempdir().unwrap();
        // The browser reads commands at 3 and answers at 4.
        let mut child = Command::new("sh")
            .args([
                "-c",
                r#"exec "$@" 3<&0 4>&1 0</dev/null 1>/dev/null 2>/dev/null"#,
                "sh",
            ])
            .arg(program)
            .args([
                "--headless=new",
                "--no-sandbox",
                "--disable-gpu",
                "--disable-dev-shm-usage",
            ])
            .args(["--no-first-run", "--remote-debugging-pipe"])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut browser = Self {
            to: child.stdin.take().unwrap(),
            from: BufReader::new(child.stdout.take().unwrap()),
            child,
            session: String::new(),
            number: 0,
            _profile: profile,
        };
        let target = browser.call("Target.createTarget", json!({ "url": "about:blank" }));
        let attach = json!({ "targetId": target["targetId"], "flatten": true });
        let session = browser.call("Target.attachToTarget", attach);
        browser.session = session["sessionId"].as_str().unwrap().to_owned();
        let metrics = json!({ "width": width, "height": height, "deviceScaleFactor": if phone { 2 } else { 1 }, "mobile": phone });
        browser.call("Emulation.setDeviceMetricsOverride", metrics);
        browser.call(
            "Emulation.setTouchEmulationEnabled",
            json!({ "enabled": phone, "maxTouchPoints": 5 }),
        );
        browser.call("Page.navigate", json!({ "url": url }));
        browser
    }

    /// A command and its result.
    pub(crate) fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.number += 1;
        let mut command = json!({ "id": self.number, "method": method, "params": parameters });
        if !self.session.is_empty() {
            command["sessionId"] = json!(self.session);
        }
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
                assert!(message["error"].is_null(), "{method}: {}", message["error"]);
                return message["result"].clone();
            }
        }
    }

    /// The value of a JavaScript expression on the page.
    pub(crate) fn value(&mut self, expression: &str) -> Value {
        let parameters = json!({ "expression": expression, "returnByValue": true });
        let result = self.call("Runtime.evaluate", parameters);
        assert!(
            result["exceptionDetails"].is_null(),
            "{expression}: {}",
            result["exceptionDetails"]
        );
        result["result"]["value"].clone()
    }

    /// Waits until an expression is true.
    pub(crate) fn wait_for(&mut self, expression: &str) {
        let began = Instant::now();
        while self.value(expression) != true {
            let text = self.value("document.body.innerText");
            assert!(
                began.elapsed() < LONG,
                "never came: {expression}; the page shows {text}"
            );
            sleep(PAUSE);
        }
    }

    /// Presses, moves through all places and lets go with the mouse.
    pub(crate) fn drag(&mut self, places: &[[f64; 2]]) {
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
    pub(crate) fn touch(&mut self, steps: &[Vec<[f64; 2]>]) {
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

    /// Presses a key.
    pub(crate) fn key(&mut self, key: &str, modifiers: u32) {
        for kind in ["keyDown", "keyUp"] {
            let event = json!({ "type": kind, "key": key, "modifiers": modifiers });
            self.call("Input.dispatchKeyEvent", event);
        }
    }

    /// Clicks a button.
    pub(crate) fn click(&mut self, selector: &str) {
        self.value(&format!("document.querySelector({selector:?}).click()"));
    }
}

impl Drop for Chromium {
    fn drop(&mut self) {
        // Its helpers go with it.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
