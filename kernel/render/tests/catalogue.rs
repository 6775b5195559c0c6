//! Frames of the built-in scenes.

use modex::PlanarBuffer;
use render::{RenderMemory, RenderOptions, SceneRenderer};
use scene::catalogue::{CATALOGUE, Entry, MAX_TEXELS};

/// Ticks from a whole turn, at irregular intervals.
const TICKS: [u32; 9] = [0, 1, 89, 180, 271, 360, 447, 540, 719];

/// Calls `check` with a scene's entry and its renderer.
fn with_renderer(name: &str, check: impl FnOnce(&Entry<'_>, &mut SceneRenderer<'_>)) {
    let entry = Entry::parse(name).unwrap();
    let mut texels = Box::new([0; MAX_TEXELS]);
    let textures = entry.paint(&mut texels);
    let mut memory = in_place::boxed!(RenderMemory);
    check(
        entry,
        &mut SceneRenderer::new(&mut memory, entry.scene(&textures)),
    );
}

#[test]
fn every_frame_is_whole_and_shows_its_scene() {
    for entry in CATALOGUE {
        with_renderer(entry.name, |entry, renderer| {
            for tick in TICKS {
                let mut page = PlanarBuffer::new();
                let stats = renderer
                    .draw(&entry.pose(tick), RenderOptions::default(), &mut page)
                    .stats;
                assert_eq!(stats.dropped, 0, "{} at {tick}", entry.name);
                let pixels = stats.pixels;
                let some = (12_000..=76_800).contains(&pixels);
                assert!(some, "{} at {tick}: {pixels} pixels", entry.name);
            }
        });
    }
}

#[test]
fn the_wall_has_one_depth_in_each_column() {
    with_renderer("wall", |entry, renderer| {
        for tick in TICKS {
            renderer.at(&entry.pose(tick)).faces(|_, face| {
                let plane = face.unwrap().plane();
                assert_eq!((plane.a.down, plane.c.down), (0, 0), "at {tick}");
                assert_ne!(plane.c.right, 0, "at {tick}");
            });
        }
    });
}
