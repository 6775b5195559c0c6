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
