//! Frames of the built-in scenes.

mod common;

use common::with_renderer;
use modex::PlanarBuffer;
use render::RenderOptions;
use scene::catalogue::CATALOGUE;

/// Ticks from a whole turn, at irregular intervals.
const TICKS: [u32; 9] = [0, 1, 89, 180, 271, 360, 447, 540, 719];

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
