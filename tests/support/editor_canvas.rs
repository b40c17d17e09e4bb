//! Where the places of a frame are on the page of the editor of masks.

use crate::chromium::Chromium;

/// From places in the frame to places on the page, as the editor shows the frame at the moment.
#[derive(Debug, Clone, Copy)]
pub struct EditorCanvas {
    /// Pixels of the page a pixel of the frame.
    pub scale: f64,
    x: f64,
    y: f64,
}

impl EditorCanvas {
    /// Asks the page, once it shows the frame.
    pub fn find(page: &mut Chromium) -> Self {
        page.wait_for("Boolean(document.getElementById('canvas')?.dataset.view)");
        let expression = "(() => { const box = canvas.getBoundingClientRect(); \
            const [scale, x, y] = canvas.dataset.view.split(' ').map(Number); \
            return [scale, x + box.left, y + box.top]; })()";
        let numbers = page.value(expression);
        let number = |at: usize| numbers[at].as_f64().unwrap();
        Self {
            scale: number(0),
            x: number(1),
            y: number(2),
        }
    }

    /// The place on the page of a place in the frame.
    pub fn at(&self, x: f64, y: f64) -> [f64; 2] {
        [self.x + x * self.scale, self.y + y * self.scale]
    }
}
