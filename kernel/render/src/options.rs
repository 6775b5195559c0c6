//! What a frame is drawn with, and the counts of a drawn frame.

use scene::Pose;
use texmap::{Mapper, Order, Stats};

/// How a frame is drawn. The default is the default mapper and order, in full quality.
#[derive(Clone, Copy, Debug, Default)]
pub struct RenderOptions {
    /// The mapper in full quality.
    pub mapper: Mapper,
    /// The order in which the spans are drawn.
    pub order: Order,
    /// The pose one tick after the drawn pose. A face whose motion to this pose hides a mapper's errors is
    /// drawn in reduced quality, by a faster mapper. `None` draws every face in full quality.
    pub next: Option<Pose>,
}

/// Counts of a drawn frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drawn {
    /// Polygons, spans and pixels, drawn and dropped.
    pub stats: Stats,
    /// Faces that were drawn in reduced quality.
    pub reduced: u32,
}
