//! The error view: a frame that shows each pixel's error in the place of its texel.
//!
//! The view gets the coordinates of each pixel from the mapper that would draw it, so it shows the frame's
//! true errors and not those of a model of the mapper.

use core::ops::Range;

use modex::{Destination, HEIGHT};
use texmap::Job;
use texmap::plane::{Form, coordinate};

use crate::quality::MapperChoice;
use crate::{PosedScene, RenderOptions};

impl PosedScene<'_> {
    /// Draws the solid as [`PosedScene::draw`] does, but colours each pixel by the mapper's error there: the
    /// larger of the differences in u and v from the exact quotients, in 2^-16 texel. Columns outside
    /// `columns` may be left out. Returns the largest error in `columns`.
    ///
    /// The spans are always drawn polygon by polygon: this view shows errors, not costs.
    pub fn draw_errors(
        &self,
        options: RenderOptions,
        columns: Range<u16>,
        colour: impl Fn(u32) -> u8,
        destination: &mut impl Destination,
    ) -> u32 {
        let choice = MapperChoice::new(&options, &self.pose);
        let mut most = 0;
        self.faces.each(|number, face| {
            let Some(face) = face else { return };
            let texture = self.faces.surfaces.texture(face.texture);
            let plane = face.plane();
            let error = |(x, y): (u16, u16), (u, v): (i32, i32)| {
                let c = plane.c.at(x, y);
                let off = |found: i32, form: Form, size: u16| {
                    found.abs_diff(coordinate(form.at(x, y), c, size))
                };
                off(u, plane.a, texture.width()).max(off(v, plane.b, texture.height()))
            };
            let mut draw = |job: Job| {
                if job.is_column() && !columns.contains(&job.x) {
                    return;
                }
                let mut strip = Strip::new();
                job.pixels(&texture, |place, coordinates| {
                    let error = error(place, coordinates);
                    if columns.contains(&place.0) {
                        most = most.max(error);
                    }
                    strip.push(place, colour(error), destination);
                });
                strip.draw(destination);
            };
            // A face outside the legal range is not drawn in a normal frame either.
            let _ = choice
                .mapper(&face)
                .jobs(&face, &texture, |job| match self.visible {
                    None => draw(job),
                    Some(visible) => visible.cut(number, &job, &mut draw),
                });
        });
        most
    }
}

/// A vertical strip of pixels that is not drawn yet.
struct Strip {
    place: (u16, u16),
    colours: [u8; HEIGHT],
    len: u16,
}

impl Strip {
    fn new() -> Self {
        Self {
            place: (0, 0),
            colours: [0; HEIGHT],
            len: 0,
        }
    }

    /// Adds a pixel. If the pixel does not continue the strip, the strip is drawn first.
    fn push(&mut self, place: (u16, u16), colour: u8, destination: &mut impl Destination) {
        if place != (self.place.0, self.place.1 + self.len) {
            self.draw(destination);
            self.place = place;
        }
        self.colours[usize::from(self.len)] = colour;
        self.len += 1;
    }

    /// Draws the strip and empties it.
    fn draw(&mut self, destination: &mut impl Destination) {
        let (x, y) = self.place;
        if self.len > 0 {
            let mut colours = self.colours.iter().copied();
            destination.column(x, y, self.len, |column| {
                column.fill(|| colours.next().unwrap_or_default());
            });
        }
        self.len = 0;
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use crate::{RenderMemory, RenderOptions, SceneRenderer};
    use modex::{PlanarBuffer, WIDTH};
    use scene::Pose;
    use scene::catalogue::{CATALOGUE, Entry, MAX_TEXELS};
    use std::boxed::Box;
    use texmap::Mapper;

    /// Calls `check` with a scene's entry and its renderer.
    fn with_renderer(name: &str, check: impl FnOnce(&Entry<'_>, &mut SceneRenderer<'_>)) {
        let entry = CATALOGUE.iter().find(|entry| entry.name == name).unwrap();
        let mut texels = Box::new([0; MAX_TEXELS]);
        let textures = entry.paint(&mut texels);
        let mut memory = in_place::boxed!(RenderMemory);
        check(
            entry,
            &mut SceneRenderer::new(&mut memory, entry.scene(&textures)),
        );
    }

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
}
