//! Frames that show the errors of mappers.

use core::ops::Range;

use modex::{Destination, HEIGHT};
use texmap::Job;
use texmap::plane::coordinate;

use super::motion::Quality;
use super::{Stage, lit, polygons};
use crate::Pose;

impl Stage<'_> {
    /// Draws the solid as [`Stage::draw`] does, but colours each pixel by the mapper's error there: the
    /// larger of the differences in u and v from the exact quotients, in 2^-16 texel. Columns outside
    /// `columns` may be left out. Returns the largest error in `columns`.
    ///
    /// The order is always polygon by polygon: this view shows errors, not costs.
    pub fn draw_errors(
        &mut self,
        pose: &Pose,
        columns: Range<u16>,
        colour: impl Fn(u32) -> u8,
        destination: &mut impl Destination,
    ) -> u32 {
        if !self.mesh.convex {
            self.find_visible(pose);
        }
        let visible = &*self.visible;
        let quality = Quality::of(self.mapper, pose, self.next.as_ref());
        let mut most = 0;
        polygons(
            &self.mesh,
            self.mipmaps,
            self.points,
            pose,
            |face_number, face| {
                let Some(face) = face else { return };
                let texture = lit(&self.surfaces, self.texels, face.texture);
                let plane = face.plane();
                let error = |(x, y): (u16, u16), (u, v): (i32, i32)| {
                    let c = plane.c.at(x, y);
                    let off = |found: i32, form: texmap::plane::Form, size: u16| {
                        found.abs_diff(coordinate(form.at(x, y), c, size))
                    };
                    off(u, plane.a, texture.width()).max(off(v, plane.b, texture.height()))
                };
                let mut draw = |job: Job| {
                    if job.is_column() && !columns.contains(&job.x) {
                        return;
                    }
                    let mut run = Run::new();
                    job.pixels(&texture, |place, coordinates| {
                        let error = error(place, coordinates);
                        if columns.contains(&place.0) {
                            most = most.max(error);
                        }
                        run.push(place, colour(error), destination);
                    });
                    run.draw(destination);
                };
                // A face outside the legal range is not drawn in a normal frame either.
                let _ = quality
                    .mapper(&face)
                    .jobs(&face, &texture, |job| match self.mesh.convex {
                        true => draw(job),
                        false => visible.cut(face_number, &job, &mut draw),
                    });
            },
        );
        most
    }
}

/// A vertical strip of pixels that is not drawn yet.
struct Run {
    place: (u16, u16),
    colours: [u8; HEIGHT],
    len: u16,
}

impl Run {
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
    use crate::catalogue::{CATALOGUE, Entry, MAX_TEXELS};
    use crate::{Pose, Stage, Storage};
    use modex::{PlanarBuffer, WIDTH};
    use std::boxed::Box;
    use texmap::Mapper;

    /// Calls `check` with a scene's entry and a stage of it.
    fn staged(name: &str, check: impl FnOnce(&Entry<'_>, &mut Stage<'_>)) {
        let entry = CATALOGUE.iter().find(|entry| entry.name == name).unwrap();
        let mut texels = Box::new([0; MAX_TEXELS]);
        let textures = entry.paint(&mut texels);
        let mut storage = in_place::boxed!(Storage);
        check(entry, &mut Stage::new(&mut storage, entry.scene(&textures)));
    }

    /// The largest error of a frame. Every pixel of the solid has an error, and no other pixel has.
    fn largest(stage: &mut Stage<'_>, pose: &Pose) -> u32 {
        let mut drawn = Box::new(PlanarBuffer::new());
        let stats = stage.draw(pose, &mut *drawn);
        let mut page = Box::new(PlanarBuffer::new());
        let found = stage.draw_errors(pose, 0..WIDTH as u16, |_| 1, &mut *page);
        let with = page.planes.as_flattened().iter().filter(|&&byte| byte == 1);
        assert_eq!(with.count(), stats.pixels as usize);
        // The largest error of a part is at most that of the whole.
        assert!(stage.draw_errors(pose, 108..212, |_| 0, &mut *page) <= found);
        found
    }

    /// The errors agree with other measurements: `shifts` is off by some fifty texels on the tilted board,
    /// `within-T` by at most T, and the exact mapper nowhere.
    #[test]
    fn errors_are_those_of_the_mapper() {
        staged("tilted", |entry, stage| {
            for (name, least, most) in [
                ("shifts", 48.0, 75.0),
                ("row-steps", 30.0, 50.0),
                ("within-1/256", 0.003, 0.003_906_25),
                ("tiles-16", 0.7, 1.0),
                ("free-direction", 0.0, 0.01),
                ("exact", 0.0, 0.0),
            ] {
                stage.set_mapper(Mapper::parse(name).unwrap());
                let texels = f64::from(largest(stage, &entry.pose(40))) / 65_536.0;
                assert!((least..=most).contains(&texels), "{name}: {texels}");
            }
        });
    }

    /// A solid that hides parts of itself has errors at its visible pixels only.
    #[test]
    fn hidden_surfaces_have_no_error() {
        staged("knot", |entry, stage| {
            for name in ["shifts", "row-steps", "free-direction", "exact"] {
                stage.set_mapper(Mapper::parse(name).unwrap());
                assert_eq!(largest(stage, &entry.pose(40)) == 0, name == "exact");
            }
        });
    }
}
