//! The steps of a day, each by taps, and what they leave on the disk.

use std::fs;
use std::path::Path;

use relit_data::shard::Dataset;
use relit_tests::editor_canvas::EditorCanvas;
use serde_json::Value;

use crate::phone::Phone;
use crate::rig::Rig;

const READY: &str = "document.getElementById('state')?.dataset.state === 'ready'";
/// Whether the outline of the mask lies over the frame.
const OUTLINE: &str = "(() => { const line = document.getElementById('player-mask'); \
    if (!line || line.hidden || line.width === 0) return false; \
    const { data } = line.getContext('2d').getImageData(0, 0, line.width, line.height); \
    return data.filter((value, at) => at % 4 === 3 && value > 0).length > 200; })()";

/// A rig, and the phone beside it.
pub(crate) struct Day<'a> {
    rig: &'a Rig,
    phone: Phone,
}

impl<'a> Day<'a> {
    pub(crate) fn begin(rig: &'a Rig, phone: Phone) -> Self {
        Self { rig, phone }
    }

    /// From an empty table to a verified data set, and on to the next object.
    pub(crate) fn go_through(mut self) {
        self.name_the_object();
        let cow = self.record();
        self.see_the_mask_by_the_turn(&cow);
        self.correct_it_by_a_stroke(&cow);
        self.check_it();
        self.extract_it(&cow);
        self.rate_it(&cow);
        self.delete_it_and_have_it_back(&cow);
        self.find_the_trash_after_a_reload(&cow);
        self.verify_the_data_set();
        self.have_takes_processed_when_done();
        let calf = self.record_the_next(&cow);
        self.find_all_of_it_done(&calf);
    }

    /// The button asks for a name, and a name with a space gets a dash.
    fn name_the_object(&mut self) {
        let phone = &mut self.phone;
        phone.wait_text("#phase", "Ready");
        phone.wait_text("#go", "Name the object");
        phone.wait_text("#no-sessions", "No sessions yet");
        phone.wait_for("!document.getElementById('preview').classList.contains('stale')");
        phone.see("empty-table");
        phone.tap("#go");
        phone.wait_for("document.activeElement.id === 'object'");
        for (typed, name) in [
            ("spotted  cow (2)", "spotted-cow-2"),
            ("  .blue / red mug ", "blue-red-mug"),
            ("M\u{fc}sli bowl_1.5", "M\u{fc}sli-bowl_1.5"),
        ] {
            phone.page().type_text(typed);
            phone.wait_button(&format!("Start {name}"), true);
            phone.wait_text("#saved-as", name);
            phone.page().erase(typed.chars().count());
        }
        phone.wait_text("#go", "Name the object");
        phone.page().type_text("...");
        phone.wait_text("#wrong-name", "letter");
        phone.see("wrong-name");
        phone.page().erase("...".len());
        phone.write("#object", "spotted cow");
        phone.wait_button("Start spotted-cow", true);
        phone.see("named");
    }

    /// Returns the session's name.
    fn record(&mut self) -> String {
        let longest = self.rig.turn.longest;
        let phone = &mut self.phone;
        phone.tap("#go");
        phone.wait_text("#phase", "Recording");
        phone.wait_for("document.getElementById('progress').value > 0.1");
        phone.wait_button("Stop", true);
        phone.see("recording");
        phone.wait_text_so_long("#last-open", "clean", longest);
        phone.wait_text_so_long("#phase", "Ready", longest);
        phone.wait_text("#go", "Start spotted-cow");
        assert_eq!(
            phone.value("document.getElementById('object').value"),
            "spotted-cow"
        );
        phone.wait_text("#sessions .day", "1 recorded");
        phone.see("recorded");
        let sessions = self.sessions();
        assert_eq!(sessions.len(), 1, "{sessions:?}");
        let cow = sessions[0].clone();
        assert!(cow.ends_with("Z-spotted-cow"), "{cow}");
        assert_eq!(self.manifest(&cow)["video"]["frames"], self.rig.turn.frames);
        cow
    }

    /// It is made as soon as the session is opened, here by a tap on the last take.
    fn see_the_mask_by_the_turn(&mut self, session: &str) {
        let longest = self.rig.turn.longest;
        let phone = &mut self.phone;
        phone.tap("#last-open");
        phone.wait_text("#player-title", "cow");
        phone.wait_so_long(OUTLINE, longest);
        phone.wait_text("#mask-text", "automatic");
        phone.wait_text("#make-mask", "Make again");
        phone.wait_for("document.getElementById('player-shard').hidden");
        phone.see("mask-by-the-turn");
        phone.value("document.getElementById('made').scrollIntoView()");
        phone.see("steps");
        self.mask_is_right(session);
    }

    fn correct_it_by_a_stroke(&mut self, session: &str) {
        let longest = self.rig.turn.longest;
        let [x, y] = self.middle();
        let phone = &mut self.phone;
        phone.tap("#edit-mask");
        phone.wait_so_long("location.pathname === '/edit/'", longest);
        phone.wait_so_long(READY, longest);
        phone.tap("[data-tool=object]");
        phone.see("editor");
        let canvas = EditorCanvas::find(phone.page());
        let stroke = [-12.0, 0.0, 12.0].map(|way| vec![canvas.at(x + way, y)]);
        phone.page().touch(&stroke);
        phone.wait_for("!document.getElementById('undo').disabled");
        phone.wait_so_long(READY, longest);
        phone.see("stroke");
        phone.tap("#accept");
        phone.wait_so_long("location.pathname === '/'", longest);
        phone.wait_so_long(OUTLINE, longest);
        phone.wait_text("#mask-text", "drawn by hand");
        phone.see("corrected");
        self.mask_is_right(session);
        let record = fs::read(self.rig.sessions().join(session).join("mask.json")).unwrap();
        let record: Value = serde_json::from_slice(&record).unwrap();
        let strokes = record["hints"]["strokes"].as_array().unwrap();
        assert_eq!(strokes.len(), 1, "{record}");
        let place: [f64; 2] = serde_json::from_value(strokes[0]["points"][0].clone()).unwrap();
        assert!((place[0] - x + 12.0).abs() < 2.0 && (place[1] - y).abs() < 2.0);
    }

    fn check_it(&mut self) {
        let longest = self.rig.turn.longest;
        let phone = &mut self.phone;
        phone.tap("#make-check");
        phone.wait_text_so_long("#check-text", "fits", longest);
        phone.see("checked");
        phone.tap("#check-page");
        phone.look_into_opened("check-page", "mask");
    }

    fn extract_it(&mut self, session: &str) {
        let longest = self.rig.turn.longest;
        let phone = &mut self.phone;
        phone.tap("#make-extract");
        phone.wait_so_long("document.getElementById('job-progress').value > 0", longest);
        phone.wait_text("#job-text", "Extracting");
        phone.value("document.getElementById('made').scrollIntoView()");
        phone.see("extracting");
        phone.wait_so_long("document.getElementById('job').hidden", longest);
        let dataset = Dataset::read(&self.rig.dataset()).unwrap();
        let entry = dataset.sessions.iter().find(|entry| entry.id == session);
        let entry = entry.unwrap();
        assert_eq!(entry.samples, 1500);
        let verdict = entry.quality.verdict;
        phone.wait_text("#extract-text", &format!("1500 samples, {verdict}"));
        let narrow = "[...document.querySelectorAll('.steps > li > p:first-child')].some((part) => part.clientWidth < 100)";
        assert_eq!(phone.value(narrow), false);
        phone.see("extracted");
        phone.tap("#report-page");
        phone.look_into_opened("report", session);
        let shard = format!("{session}.tar");
        self.download_is(
            &["#player-shard", "#last-shard"],
            &self.rig.dataset().join(shard),
        );
    }

    /// The links lead to the bytes of this file.
    fn download_is(&mut self, links: &[&str], file: &Path) {
        let phone = &mut self.phone;
        let bytes = fs::metadata(file).unwrap().len();
        for link in links {
            phone.wait_for(&format!(
                "(() => {{ const link = document.querySelector({link:?}); \
                    if (!link.hidden && !link.dataset.size) {{ \
                        link.dataset.size = 'asked'; \
                        fetch(link.href).then((answer) => answer.blob()).then(({{ size }}) => link.dataset.size = size); }} \
                    return link.dataset.size === '{bytes}'; }})()"
            ));
        }
    }

    /// Stars and a note, which are saved as they are given, and the list afterwards.
    fn rate_it(&mut self, session: &str) {
        let phone = &mut self.phone;
        phone.tap("#stars button:nth-child(4)");
        phone.wait_text("#saved", "Saved");
        phone.write("#note", "a stroke across the belly");
        phone.see("remarks");
        phone.tap("#player-close");
        phone.wait_for("!document.getElementById('player').open");
        phone.wait_text("#sessions .day", "1 recorded · 1 masked · 1 extracted");
        phone.wait_text("#sessions li button .standing", "extracted");
        phone.wait_text("#sessions li button", "★★★★");
        phone.value("document.getElementById('sessions-title').scrollIntoView()");
        phone.see("list");
        let manifest = self.manifest(session);
        assert_eq!(manifest["rating"], 4, "{manifest}");
        assert_eq!(manifest["note"], "a stroke across the belly");
    }

    /// Undo is where the finger was.
    fn delete_it_and_have_it_back(&mut self, session: &str) {
        let folder = self.rig.sessions().join(session);
        let phone = &mut self.phone;
        phone.tap("#sessions li button");
        phone.wait_text("#extract-text", "1500 samples");
        phone.wait_for(OUTLINE);
        let place = "(() => { const box = document.getElementById('put-away').getBoundingClientRect(); \
            return [box.top, box.bottom, box.right]; })()";
        phone.value("document.getElementById('put-away').scrollIntoView({ block: 'center' })");
        let before = phone.value(place);
        phone.tap("#put-away");
        phone.wait_text("#put-away", "Undo");
        phone.wait_text("#trashed", "In the trash");
        assert_eq!(phone.value(place), before);
        assert!(!folder.exists());
        phone.see("in-the-trash");
        phone.tap("#put-away");
        phone.wait_text("#put-away", "Delete");
        phone.wait_for("document.getElementById('trashed').hidden");
        assert!(folder.is_dir());
    }

    fn find_the_trash_after_a_reload(&mut self, session: &str) {
        let folder = self.rig.sessions().join(session);
        let phone = &mut self.phone;
        phone.tap("#put-away");
        phone.wait_text("#put-away", "Undo");
        phone.page().reload();
        phone.wait_text("#trash-title", "Trash (1)");
        phone.wait_text("#trash", "cow");
        phone.wait_text("#no-sessions", "No sessions yet");
        phone.value("document.getElementById('trash-card').scrollIntoView()");
        phone.see("trash-after-reload");
        assert!(!folder.exists());
        phone.tap("#trash button");
        phone.wait_text("#sessions li button .standing", "extracted");
        phone.wait_for("document.getElementById('trash-card').hidden");
        assert!(folder.is_dir());
    }

    fn verify_the_data_set(&self) {
        let verified = self.rig.verify();
        assert_eq!(verified.status.code(), Some(0), "{verified:?}");
    }

    fn have_takes_processed_when_done(&mut self) {
        let phone = &mut self.phone;
        phone.tap("#when-done");
        phone.wait_for(
            "fetch('/api/v1/processing').then((answer) => answer.json()).then((now) => window.kept = now.when_done) && window.kept === true",
        );
        phone.wait_for("document.getElementById('when-done').checked");
    }

    /// While it is recorded nothing else begins: what is requested waits, and can be cancelled.
    fn record_the_next(&mut self, before: &str) -> String {
        let longest = self.rig.turn.longest;
        let phone = &mut self.phone;
        phone.value("document.getElementById('object').value = ''");
        phone.write("#object", "calf");
        phone.wait_text("#go", "Start calf");
        phone.tap("#go");
        phone.wait_text("#phase", "Recording");
        phone.tap("#sessions li button:enabled");
        phone.wait_text("#player-title", "cow");
        phone.tap("#make-extract");
        phone.wait_text("#job-text", "Extracting: waiting");
        phone.value("document.getElementById('made').scrollIntoView()");
        phone.see("waits-for-the-rig");
        phone.tap("#job-cancel");
        phone.wait_text("#job-failed", "Extraction: cancelled");
        phone.tap("#player-close");
        // The next that opens is not shown with the steps of this one.
        phone.wait_for("document.getElementById('make-extract').disabled");
        assert_eq!(phone.text("#mask-text"), "…");
        phone.wait_text_so_long("#last-open", "calf", longest);
        phone.wait_text("#last-open", "clean");
        let sessions = self.sessions();
        let calf = sessions.iter().find(|session| *session != before).unwrap();
        assert!(calf.ends_with("Z-calf"), "{calf}");
        calf.clone()
    }

    fn find_all_of_it_done(&mut self, session: &str) {
        let longest = self.rig.turn.longest;
        let phone = &mut self.phone;
        phone.wait_text("#jobs", "calf");
        phone.value("document.getElementById('processing-title').scrollIntoView()");
        phone.see("processed-by-itself");
        phone.wait_text_so_long(
            "#sessions .day",
            "2 recorded · 2 masked · 2 extracted",
            longest,
        );
        phone.wait_text_so_long("#phase", "Ready", longest);
        phone.wait_text("#go", "Start");
        phone.value("document.getElementById('sessions-title').scrollIntoView()");
        phone.see("end-of-the-day");
        self.mask_is_right(session);
        let dataset = Dataset::read(&self.rig.dataset()).unwrap();
        assert_eq!(dataset.sessions.len(), 2);
        let verified = self.rig.verify();
        assert_eq!(verified.status.code(), Some(0), "{verified:?}");
    }

    fn sessions(&self) -> Vec<String> {
        let entries = fs::read_dir(self.rig.sessions()).unwrap();
        let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
        names.filter(|name| !name.starts_with('.')).collect()
    }

    fn manifest(&self, session: &str) -> Value {
        let file = self.rig.sessions().join(session).join("session.json");
        serde_json::from_slice(&fs::read(file).unwrap()).unwrap()
    }

    /// A place in the middle of the object.
    fn middle(&self) -> [f64; 2] {
        let mask = self.rig.true_mask();
        let inside = mask
            .enumerate_pixels()
            .filter(|(_, _, value)| value.0[0] > 0);
        let places: Vec<(u32, u32)> = inside.map(|(x, y, _)| (x, y)).collect();
        let mean = |side: fn(&(u32, u32)) -> u32| {
            f64::from(places.iter().map(side).sum::<u32>()) / places.len() as f64
        };
        let [x, y] = [mean(|place| place.0), mean(|place| place.1)];
        assert!(mask.get_pixel(x as u32, y as u32).0[0] > 0);
        [x, y]
    }

    /// The session's mask is that of the object.
    #[track_caller]
    fn mask_is_right(&self, session: &str) {
        let file = self.rig.sessions().join(session).join("mask.png");
        let mask = image::open(file).unwrap().into_luma8();
        let truth = self.rig.true_mask();
        let pairs = mask.pixels().zip(truth.pixels());
        let both = pairs.map(|(one, other)| (one.0[0] >= 128, other.0[0] >= 128));
        let count = |wanted: fn(bool, bool) -> bool| {
            both.clone()
                .filter(|&(one, other)| wanted(one, other))
                .count() as f64
        };
        let iou = count(|one, other| one && other) / count(|one, other| one || other);
        assert!(iou > 0.95, "{iou}");
    }
}
