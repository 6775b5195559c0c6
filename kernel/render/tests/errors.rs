//! The error view agrees with other measurements of the mappers' errors.

mod common;

use common::with_renderer;
use modex::{PlanarBuffer, WIDTH};
use render::{RenderOptions, SceneRenderer};
use scene::Pose;
use texmap::Mapper;

/// Returns the largest error of a frame, after checking that exactly as many pixels have an error as the
/// solid has.
fn largest(renderer: &mut SceneRenderer<'_>, mapper: &str, pose: &Pose) -> u32 {
    let options = RenderOptions {
        mapper: Mapper::parse(mapper).unwrap(),
        ..RenderOptions::default()
    };
    let mut posed = renderer.at(pose);
    let mut drawn = Box::new(PlanarBuffer::new());
    let stats = posed.draw(options, &mut *drawn).stats;
    let mut page = Box::new(PlanarBuffer::new());
    let found = posed.draw_errors(options, 0..WIDTH as u16, |_| 1, &mut *page);
    let with = page.planes.as_flattened().iter().filter(|&&byte| byte == 1);
    assert_eq!(with.count(), stats.pixels as usize);
    // The largest error of a part is at most that of the whole.
    assert!(posed.draw_errors(options, 108..212, |_| 0, &mut *page) <= found);
    found
}

/// The errors agree with other measurements: `shifts` is off by some fifty texels on the tilted board,
/// `within-T` by at most T, and the exact mapper nowhere.
#[test]
fn errors_are_those_of_the_mapper() {
    with_renderer("tilted", |entry, renderer| {
        for (name, least, most) in [
            ("shifts", 48.0, 75.0),
            ("row-steps", 30.0, 50.0),
            ("within-1/256", 0.003, 0.003_906_25),
            ("tiles-16", 0.7, 1.0),
            ("free-direction", 0.0, 0.01),
            ("exact", 0.0, 0.0),
        ] {
            let texels = f64::from(largest(renderer, name, &entry.pose(40))) / 65_536.0;
            assert!((least..=most).contains(&texels), "{name}: {texels}");
        }
    });
}

/// A solid that hides parts of itself has errors at its visible pixels only.
#[test]
fn hidden_surfaces_have_no_error() {
    with_renderer("knot", |entry, renderer| {
        for name in ["shifts", "row-steps", "free-direction", "exact"] {
            assert_eq!(
                largest(renderer, name, &entry.pose(40)) == 0,
                name == "exact"
            );
        }
    });
}
