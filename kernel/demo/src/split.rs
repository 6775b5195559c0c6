//! The split view: one frame three times, drawn by the current mapper, drawn exactly, and as its error.
//!
//! Each panel shows the same 104 columns from the middle of the frame. The panels are multiples of four
//! columns away from those columns, so each column of the frame keeps its plane, and no mapper has to know
//! about the split view.
//!
//! The error is a heat map: black and blue are invisible fractions of a texel, teal is up to one texel, gold
//! is a few texels, and rose and white are large errors.

use core::ops::Range;

use modex::{Destination, HEIGHT, Palette, Rgb6, WIDTH, Window};
use render::{Drawn, RenderOptions, SceneRenderer};
use scene::Pose;
use texmap::Mapper;

use crate::palette::nearest;

/// The columns of the frame that each panel shows.
const COLUMNS: Range<u16> = 108..212;
/// First column of each panel.
pub(crate) const PANELS: [usize; 3] = [0, 108, 216];
/// Columns in a panel.
const PANEL: usize = COLUMNS.end as usize - COLUMNS.start as usize;
const _: () = assert!(PANELS[2] + PANEL == WIDTH);

/// Steps of the heat map: the first is below 1/256 texel, each further step begins where the error has
/// doubled, and the last is 64 texels and more.
pub(crate) const STEPS: usize = 16;
/// The step that begins at one texel.
pub(crate) const TEXEL: usize = 9;
/// Binary logarithm of 1/256 texel in units of 2^-16 texel: where the first step ends.
const FIRST: u32 = 8;

/// Columns of a step in the legend. The constants after it are the legend's lines, left border and top.
pub(crate) const LEGEND_STEP: usize = 6;
pub(crate) const LEGEND_LINES: usize = 5;
pub(crate) const LEGEND_X: usize = PANELS[2] + (PANEL - STEPS * LEGEND_STEP) / 2;
pub(crate) const LEGEND_Y: usize = HEIGHT - 29;

/// The heat map's colours. In a palette that contains them, the steps are distinct.
#[rustfmt::skip]
pub const HEAT: [Rgb6; STEPS] = [
    [ 1,  1,  7], [ 3,  4, 17], [ 6,  7, 26], [10, 13, 37], [15, 19, 48], // up to 1/16
    [ 8, 27, 49], [ 5, 34, 39], [15, 44, 46], [26, 54, 53], // up to 1
    [46, 28,  8], [55, 40, 14], [62, 51, 20], // up to 8
    [48, 11, 36], [61, 35, 47], [63, 58, 60], [63, 63, 63],
];

/// Returns the heat map's step for an error in 2^-16 texel.
fn step(error: u32) -> usize {
    let log = error.checked_ilog2().unwrap_or(0);
    (log + 1).saturating_sub(FIRST).min(STEPS as u32 - 1) as usize
}

/// The palette entries of the heat map.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SplitView {
    heat: [u8; STEPS],
    black: u8,
}

impl SplitView {
    /// Returns the entries of a palette that are nearest to the heat map's colours.
    pub fn new(palette: &Palette) -> Self {
        Self {
            heat: HEAT.map(|colour| nearest(palette, colour)),
            black: nearest(palette, [0; 3]),
        }
    }

    /// Draws the three panels. Returns the counts of the first panel, and the largest error in the last, in
    /// 2^-16 texel.
    pub fn draw(
        &self,
        renderer: &mut SceneRenderer<'_>,
        pose: &Pose,
        options: RenderOptions,
        destination: &mut impl Destination,
    ) -> (Drawn, u32) {
        let [left, middle, right] = PANELS.map(|x| x as u16);
        let exact = RenderOptions {
            mapper: Mapper::Exact,
            next: None,
            ..options
        };
        let mut posed = renderer.at(pose);
        posed.draw(exact, &mut Window::new(destination, COLUMNS, middle));
        let colour = |error| self.heat[step(error)];
        let mut panel = Window::new(destination, COLUMNS, right);
        let largest_error = posed.draw_errors(options, COLUMNS, colour, &mut panel);
        let drawn = posed.draw(options, &mut Window::new(destination, COLUMNS, left));
        (drawn, largest_error)
    }

    /// Draws the bars between the panels, and the heat map's legend.
    pub fn draw_bars_and_legend(&self, destination: &mut impl Destination) {
        let (left, top) = (LEGEND_X, LEGEND_Y);
        for plane in 0..4 {
            destination.select(plane as u16);
            for panel in &PANELS[1..] {
                let x = panel - 4 + plane;
                destination.lane::<{ modex::STRIDE }>(x as u16, 0, HEIGHT as u16, |column| {
                    column.fill(|| self.black);
                });
            }
            let columns = left..left + STEPS * LEGEND_STEP;
            for x in columns.filter(|x| x % 4 == plane) {
                let colour = self.heat[(x - left) / LEGEND_STEP];
                let (x, y, lines) = (x as u16, top as u16, LEGEND_LINES as u16);
                destination.lane::<{ modex::STRIDE }>(x, y, lines, |column| {
                    column.fill(|| colour);
                });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_step_doubles_the_error() {
        assert_eq!([0, 1, 255].map(step), [0; 3]);
        for (i, log) in (FIRST..FIRST + 15).enumerate() {
            let error = 1 << log;
            assert_eq!((step(error - 1), step(error)), (i, i + 1));
        }
        assert_eq!(step(1 << 16), TEXEL);
        assert_eq!(step(u32::MAX), STEPS - 1);
    }

    #[test]
    fn the_built_in_palette_has_a_different_colour_for_each_step() {
        let palette = scene::catalogue::CATALOGUE[0].scene(&[]).palette;
        let heat = SplitView::new(palette).heat;
        for (i, a) in heat.iter().enumerate() {
            assert!(!heat[..i].contains(a), "step {i}");
        }
    }
}
