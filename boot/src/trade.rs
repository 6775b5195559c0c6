//! What accuracy costs: every mapper's error and time on every scene, as tables, plots and pages.

pub mod accuracy;
pub mod clock;
pub mod cost;
pub mod page;
pub mod plot;
pub mod seeds;
pub mod stats;
pub mod subject;
pub mod table;
