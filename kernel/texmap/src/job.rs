//! Jobs: spans of pixels to draw, and the bounded list that holds them.

use core::iter;

use modex::{Column, Destination, Lane};

use crate::coverage::Axis;
use crate::loops::{Draw, DrawLinear, Loop};
use crate::places::{Part, Places, Row};
use crate::runs::{self, Cuts, Pieces, Steps};
use crate::within::Tolerance;
use crate::{Texture, adaptive, affine, exact, free, level, plane};

/// How the texture coordinates advance along a span: start values and steps, in a mapper's own
/// form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Walk {
    /// Constant steps: see [`affine`].
    Affine(affine::Walk),
    /// A quotient for every pixel: see [`exact`].
    Exact(plane::Walk),
    /// Linear pieces: see [`Steps::linear`].
    Linear(plane::Walk, Pieces),
    /// Quadratic pieces: see [`Steps::quadratic`].
    Quadratic(plane::Walk, Pieces),
    /// Linear pieces within a tolerance: see [`adaptive`].
    Adaptive(plane::Walk, Tolerance),
    /// Constant depth, with only one coordinate stepped: see [`level`].
    Wall(level::Wall),
    /// A span that leaves its row or column: see [`free`].
    Free(free::Walk),
}

/// How the pixels of a row are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rows {
    /// Computes address, plane and texel from scratch for every pixel.
    Multiply,
    /// Steps everything, and selects the plane for every pixel.
    Steps,
    /// Draws the row in four passes, one for each plane.
    Passes,
    /// Makes all texels one after the other, and then writes the planes: see [`Destination::line`].
    #[default]
    Lines,
}

/// Under [`Rows::Lines`], affine rows of fewer pixels are stepped instead: a line is first made in
/// RAM, and that costs as much as selecting a plane about eight times. Most spans in the free
/// direction are this short.
const SHORT_ROW: u16 = 8;

/// How spans are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Style {
    /// The loop for affine columns.
    pub affine: Loop,
    /// The way to write rows.
    pub rows: Rows,
}

impl Style {
    /// Returns the functions that draw in this style on this CPU.
    pub(crate) fn tools(self) -> Tools {
        Tools {
            column: self.affine.draw(),
            linear: self.affine.draw_linear(),
            extract: self.affine == Loop::Extract && Loop::Extract.is_tuned_here(),
            rows: self.rows,
        }
    }
}

/// A [`Style`] with its functions looked up: once for many spans.
#[derive(Debug)]
pub(crate) struct Tools {
    /// Draws affine columns.
    pub column: Draw,
    /// Draws columns in linear pieces.
    linear: DrawLinear,
    /// Whether affine rows are drawn with the CPU's bit-extract.
    pub extract: bool,
    rows: Rows,
}

/// One span to draw: its place, and everything its inner loop needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Job {
    /// Direction: down a column or along a row.
    pub axis: Axis,
    /// The first pixel's column, 0 to 319.
    pub x: u16,
    /// The first pixel's row, 0 to 239.
    pub y: u16,
    /// The number of pixels, at least 1.
    pub len: u16,
    /// Index of the texture among the scene's textures.
    pub texture: u16,
    /// The texture coordinates along the span.
    pub walk: Walk,
}

impl Job {
    /// Returns the job of `len` pixels from pixel `first` of column or row `line`.
    pub(crate) fn new(
        axis: Axis,
        line: u16,
        first: u16,
        len: u16,
        texture: u16,
        walk: Walk,
    ) -> Self {
        let (x, y) = match axis {
            Axis::Down => (line, first),
            Axis::Right => (first, line),
        };
        Self {
            axis,
            x,
            y,
            len,
            texture,
            walk,
        }
    }

    /// Passes each pixel with its texture coordinates, 16.16, to `sink`: the reference
    /// implementation of [`Job::draw`]. Coordinates of the exact mapper are rounded down.
    pub fn pixels(&self, texture: &Texture<'_>, mut sink: impl FnMut((u16, u16), (i32, i32))) {
        let mut pixels = |job: &Self| {
            let mut coordinates = Coordinates::new(job, texture);
            for i in 0..job.len {
                let place = job.place(i);
                sink(place, coordinates.next());
            }
        };
        let Walk::Adaptive(walk, tolerance) = &self.walk else {
            return pixels(self);
        };
        let mut part = |first, len, walk| {
            let (x, y) = self.place(first);
            pixels(&Self {
                x,
                y,
                len,
                walk,
                ..*self
            });
        };
        let mut pieces = self.pieces(walk, *tolerance, texture);
        for piece in pieces.by_ref() {
            part(piece.first, piece.len, Walk::Affine(piece.walk));
        }
        if let Some((first, len, walk)) = pieces.rest() {
            part(first, len, Walk::Exact(walk));
        }
    }

    /// Returns the pieces of an adaptive span.
    #[inline]
    fn pieces(
        &self,
        walk: &plane::Walk,
        tolerance: Tolerance,
        texture: &Texture<'_>,
    ) -> adaptive::Pieces {
        let row = (self.axis == Axis::Right).then_some(self.x);
        adaptive::Pieces::new(walk, self.len, row, tolerance, texture)
    }

    /// Returns whether the span stays in one column.
    pub fn is_column(&self) -> bool {
        self.axis == Axis::Down && !matches!(self.walk, Walk::Free(_))
    }

    /// Returns the job of the `len` pixels from pixel `first` of this span on.
    ///
    /// Pieces start again at the part's first pixel. They are no longer than the pieces of the
    /// whole span, and lie within it, so every [bound](crate::bounds) still holds.
    pub(crate) fn part(&self, first: u16, len: u16) -> Self {
        let (x, y) = self.place(first);
        let after = |mut walk: plane::Walk| {
            walk.at = walk.after(first);
            walk
        };
        let walk = match self.walk {
            Walk::Affine(walk) => Walk::Affine(walk.every(1, first.into())),
            Walk::Exact(walk) => Walk::Exact(after(walk)),
            Walk::Linear(walk, pieces) => Walk::Linear(after(walk), pieces),
            Walk::Quadratic(walk, pieces) => Walk::Quadratic(after(walk), pieces),
            Walk::Adaptive(walk, tolerance) => Walk::Adaptive(after(walk), tolerance),
            Walk::Wall(wall) => Walk::Wall(wall.after(first)),
            Walk::Free(walk) => Walk::Free(walk.after(first)),
        };
        Self {
            x,
            y,
            len,
            walk,
            ..*self
        }
    }

    /// Returns the place (x, y) of pixel `i` of the span.
    #[inline]
    pub(crate) fn place(&self, i: u16) -> (u16, u16) {
        let aside = match &self.walk {
            Walk::Free(walk) => walk.aside(i),
            _ => 0,
        };
        match self.axis {
            Axis::Down => (self.x.wrapping_add_signed(aside), self.y + i),
            Axis::Right => (self.x + i, self.y.wrapping_add_signed(aside)),
        }
    }

    /// Draws the span.
    #[inline]
    pub fn draw(&self, style: Style, texture: &Texture<'_>, destination: &mut impl Destination) {
        self.draw_with(&style.tools(), texture, destination);
    }

    #[inline(always)]
    pub(crate) fn draw_with(
        &self,
        tools: &Tools,
        texture: &Texture<'_>,
        destination: &mut impl Destination,
    ) {
        if self.plane().is_some() {
            destination.select(self.x);
            self.draw_column(tools, texture, destination);
        } else {
            self.draw_other(tools, texture, destination);
        }
    }

    /// Draws a row, or a span in the free direction.
    #[inline(never)]
    fn draw_other(&self, tools: &Tools, texture: &Texture<'_>, destination: &mut impl Destination) {
        match &self.walk {
            Walk::Free(walk) => self.straight(walk, |job| match job.axis {
                Axis::Down => {
                    destination.select(job.x);
                    job.draw_column(tools, texture, destination);
                }
                Axis::Right => job.draw_row(tools, texture, destination),
            }),
            _ => self.draw_row(tools, texture, destination),
        }
    }

    /// Draws the span's pixels that lie in `plane`, which must be selected.
    #[inline]
    pub fn draw_in_plane(
        &self,
        plane: u16,
        style: Style,
        texture: &Texture<'_>,
        destination: &mut impl Destination,
    ) {
        if self.plane().is_none_or(|own| own == plane) {
            self.draw_in_plane_with(plane, &style.tools(), texture, destination);
        }
    }

    /// Returns the plane of a span that stays in its column. Any other span may have pixels in
    /// every plane.
    #[inline]
    fn plane(&self) -> Option<u16> {
        match (self.axis, &self.walk) {
            (Axis::Right, _) | (_, Walk::Free(_)) => None,
            (Axis::Down, _) => Some(self.x & 3),
        }
    }

    /// Draws the span's pixels that lie in `plane`, which must be selected. A column must lie in
    /// `plane`.
    #[inline(always)]
    pub(crate) fn draw_in_plane_with(
        &self,
        plane: u16,
        tools: &Tools,
        texture: &Texture<'_>,
        destination: &mut impl Destination,
    ) {
        if self.plane().is_some() {
            self.draw_column(tools, texture, destination);
        } else {
            self.draw_other_in_plane(plane, tools, texture, destination);
        }
    }

    /// Draws the pixels in `plane` of a row, or of a span in the free direction.
    #[inline(never)]
    fn draw_other_in_plane(
        &self,
        plane: u16,
        tools: &Tools,
        texture: &Texture<'_>,
        destination: &mut impl Destination,
    ) {
        match &self.walk {
            Walk::Free(walk) => self.straight(walk, |job| match job.axis {
                Axis::Down if job.x & 3 != plane => {}
                Axis::Down => job.draw_column(tools, texture, destination),
                Axis::Right => job.draw_part(plane, tools, texture, destination),
            }),
            _ => self.draw_part(plane, tools, texture, destination),
        }
    }

    /// Passes the span in the free direction to `sink` as affine spans, each within its row or
    /// column.
    fn straight(&self, walk: &free::Walk, mut sink: impl FnMut(Self)) {
        let mut first = 0;
        while first < self.len {
            let len = walk.straight(first, self.len);
            let (x, y) = self.place(first);
            sink(Self {
                x,
                y,
                len,
                walk: Walk::Affine(walk.texture.every(1, first.into())),
                ..*self
            });
            first += len;
        }
    }

    /// Draws a column, whose plane must be selected.
    #[inline(always)]
    fn draw_column(
        &self,
        tools: &Tools,
        texture: &Texture<'_>,
        destination: &mut impl Destination,
    ) {
        destination.lane(self.x, self.y, self.len, |column| match &self.walk {
            Walk::Affine(walk) => (tools.column)(texture, walk, column),
            _ => self.fill(tools, texture, column),
        });
    }

    /// Draws the pixels of a column that is not affine.
    #[inline(never)]
    fn fill(&self, tools: &Tools, texture: &Texture<'_>, column: Column<'_>) {
        match &self.walk {
            Walk::Linear(walk, pieces) => {
                (tools.linear)(texture, walk, *pieces, tools.column, column);
            }
            &Walk::Quadratic(walk, pieces) => {
                runs::quadratic(texture, walk, self.len, pieces, column);
            }
            &Walk::Exact(walk) => exact::column(texture, walk, self.len, column),
            Walk::Adaptive(walk, tolerance) => {
                let pieces = self.pieces(walk, *tolerance, texture);
                adaptive::draw::<1>(pieces, 0, texture, tools, column);
            }
            Walk::Wall(wall) => wall.column(texture, column),
            Walk::Affine(_) | Walk::Free(_) => unreachable!("they are drawn elsewhere"),
        }
    }

    /// Draws a row.
    fn draw_row(&self, tools: &Tools, texture: &Texture<'_>, destination: &mut impl Destination) {
        match (tools.rows, self.walk) {
            (Rows::Multiply, Walk::Affine(walk)) => {
                for i in 0..self.len {
                    let (u, v) = (
                        walk.u + i32::from(i) * walk.du,
                        walk.v + i32::from(i) * walk.dv,
                    );
                    destination.column(self.x + i, self.y, 1, |pixel| {
                        pixel.fill(|| texture.at(u, v));
                    });
                }
            }
            (rows, Walk::Affine(mut walk))
                if rows == Rows::Steps || rows == Rows::Lines && self.len < SHORT_ROW =>
            {
                destination.row(self.x, self.y, self.len, || texel(texture, walk.next()));
            }
            (Rows::Passes, _) => {
                for plane in 0..4u16 {
                    if plane.wrapping_sub(self.x) & 3 < self.len {
                        destination.select(plane);
                        self.draw_part(plane, tools, texture, destination);
                    }
                }
            }
            _ => destination.line(self.x, self.y, self.len, |line| {
                self.fill_row::<1>(0, tools, texture, Row { line, x: self.x });
            }),
        }
    }

    /// Draws the pixels of a row in one plane, which must be selected.
    fn draw_part(
        &self,
        plane: u16,
        tools: &Tools,
        texture: &Texture<'_>,
        destination: &mut impl Destination,
    ) {
        let first = plane.wrapping_sub(self.x) & 3;
        if first < self.len {
            let len = (self.len - first).div_ceil(4);
            destination.lane(self.x + first, self.y, len, |row: Lane<'_, 1>| {
                self.fill_row::<4>(first, tools, texture, row);
            });
        }
    }

    /// Writes the texels of every `STRIDE`th pixel of a row, from pixel `first` on, to `places`.
    fn fill_row<const STRIDE: u16>(
        &self,
        first: u16,
        tools: &Tools,
        texture: &Texture<'_>,
        mut places: impl Places,
    ) {
        let len = (self.len - first).div_ceil(STRIDE);
        match &self.walk {
            Walk::Affine(walk) => {
                let walk = walk.every(STRIDE.into(), first.into());
                places.part(0, len).affine(texture, walk, tools);
            }
            Walk::Exact(walk) => places
                .part(0, len)
                .exact(texture, walk.every(STRIDE, first)),
            Walk::Adaptive(walk, tolerance) => {
                let pieces = self.pieces(walk, *tolerance, texture);
                adaptive::draw::<STRIDE>(pieces, first, texture, tools, places);
            }
            Walk::Linear(walk, pieces) => {
                let mut cuts = Cuts::new(*walk, self.len, *pieces, texture);
                let (mut place, mut skipped) = (0, first);
                while place < len {
                    let piece = cuts.next();
                    let count = piece.pixels().saturating_sub(skipped).div_ceil(STRIDE);
                    if count > 0 {
                        let walk = piece.straight().every(STRIDE.into(), skipped.into());
                        places.part(place, count).affine(texture, walk, tools);
                    }
                    place += count;
                    skipped = skipped + count * STRIDE - piece.pixels();
                }
            }
            _ => {
                let mut coordinates = Coordinates::new(self, texture);
                (0..first).for_each(|_| _ = coordinates.next());
                places.part(0, len).fill(|| {
                    let (u, v) = coordinates.next();
                    (1..STRIDE).for_each(|_| _ = coordinates.next());
                    texture.at(u, v)
                });
            }
        }
    }
}

fn texel(texture: &Texture<'_>, coordinates: Option<(i32, i32)>) -> u8 {
    // A walk never ends, so the default is never used.
    let (u, v) = coordinates.unwrap_or_default();
    texture.at(u, v)
}

/// A span's texture coordinates, pixel after pixel.
enum Coordinates {
    Affine(affine::Walk),
    Exact(plane::Walk, (u16, u16)),
    Pieces(Steps),
    Free(free::Walk),
}

impl Coordinates {
    fn new(job: &Job, texture: &Texture<'_>) -> Self {
        match job.walk {
            Walk::Affine(walk) => Self::Affine(walk),
            Walk::Wall(wall) => Self::Affine(wall.into()),
            Walk::Exact(walk) => Self::Exact(walk, (texture.width(), texture.height())),
            Walk::Linear(walk, pieces) => {
                Self::Pieces(Steps::linear(walk, job.len, pieces, texture))
            }
            Walk::Quadratic(walk, pieces) => {
                Self::Pieces(Steps::quadratic(walk, job.len, pieces, texture))
            }
            Walk::Free(walk) => Self::Free(walk),
            Walk::Adaptive(..) => unreachable!("its pieces have them"),
        }
    }

    fn next(&mut self) -> (i32, i32) {
        match self {
            Self::Affine(walk) => walk.next().unwrap_or_default(),
            Self::Exact(walk, size) => {
                let [a, b, c] = walk.next();
                (
                    plane::coordinate(a, c, size.0),
                    plane::coordinate(b, c, size.1),
                )
            }
            Self::Pieces(steps) => steps.next().unwrap_or_default(),
            Self::Free(walk) => walk.next().unwrap_or_default(),
        }
    }
}

/// A list of at most `N` jobs, without a heap.
#[derive(Clone, Copy, Debug)]
pub struct JobList<const N: usize> {
    jobs: [Job; N],
    len: usize,
    leaves_columns: bool,
    /// For each job and plane, the index of the next job in the plane's chain: see [`ByPlane`].
    next: [[u16; 4]; N],
}

/// The jobs of a list, plane by plane.
///
/// Each plane has a chain of the jobs that may have pixels in it, so a pass visits only these jobs.
#[derive(Debug)]
pub(crate) struct ByPlane<'a> {
    jobs: &'a [Job],
    next: &'a [[u16; 4]],
    /// The index of the first job in each plane's chain.
    first: [u16; 4],
}

impl<'a> ByPlane<'a> {
    /// The end of a chain: greater than every index of a job.
    const END: u16 = u16::MAX;

    /// Returns the jobs that may have pixels in `plane`, in the order of their addition.
    #[inline]
    pub fn plane(&self, plane: u16) -> impl Iterator<Item = &'a Job> {
        let (jobs, next) = (self.jobs, self.next);
        let plane = usize::from(plane);
        let mut here = self.first[plane];
        iter::from_fn(move || {
            let job = jobs.get(usize::from(here))?;
            here = next[usize::from(here)][plane];
            Some(job)
        })
    }
}

impl<const N: usize> JobList<N> {
    const EMPTY: Job = Job {
        axis: Axis::Down,
        x: 0,
        y: 0,
        len: 0,
        texture: 0,
        walk: Walk::Affine(affine::Walk {
            u: 0,
            v: 0,
            du: 0,
            dv: 0,
        }),
    };

    /// Returns an empty list.
    pub const fn new() -> Self {
        Self {
            jobs: [Self::EMPTY; N],
            len: 0,
            leaves_columns: false,
            next: [[0; 4]; N],
        }
    }

    /// Adds a job, unless the list is full.
    ///
    /// # Errors
    /// The job, if the list is full.
    pub fn push(&mut self, job: Job) -> Result<(), Job> {
        let place = self.jobs.get_mut(self.len).ok_or(job)?;
        *place = job;
        self.len += 1;
        self.leaves_columns |= !job.is_column();
        Ok(())
    }

    /// Returns whether any of the jobs has pixels in more than one column.
    pub(crate) fn leaves_columns(&self) -> bool {
        self.leaves_columns
    }

    /// Returns the jobs, in the order of their addition.
    pub fn jobs(&self) -> &[Job] {
        &self.jobs[..self.len]
    }

    /// Returns the jobs by planes.
    pub(crate) fn by_plane(&mut self) -> ByPlane<'_> {
        const { assert!(N <= ByPlane::END as usize, "a chain's links are 16 bits") };
        let (jobs, next) = (&self.jobs[..self.len], &mut self.next[..self.len]);
        let mut first = [ByPlane::END; 4];
        // From the last job to the first, so that each job is put in front of its chains. A job's
        // links in chains that it does not belong to are never read.
        for (i, (job, next)) in jobs.iter().zip(next.iter_mut()).enumerate().rev() {
            *next = first;
            match job.plane() {
                Some(plane) => first[usize::from(plane)] = i as u16,
                None => first = [i as u16; 4],
            }
        }
        ByPlane { jobs, next, first }
    }

    /// Empties the list.
    pub fn clear(&mut self) {
        self.len = 0;
        self.leaves_columns = false;
    }
}

impl<const N: usize> Default for JobList<N> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::vec::Vec;

    use super::*;

    /// Later jobs overwrite earlier ones, so a chain must keep their order and lose no job.
    #[test]
    fn every_plane_has_its_jobs_in_the_order_in_which_they_came() {
        let mut random = seeded::generator();
        let mut list = JobList::<40>::new();
        for _ in 0..1000 {
            list.clear();
            for y in 0..random.u16(..=40) {
                let axis = [Axis::Down, Axis::Down, Axis::Right][random.usize(..3)];
                let walk = JobList::<1>::EMPTY.walk;
                let job = Job::new(axis, random.u16(..200), random.u16(..200), 1, y, walk);
                list.push(job).unwrap();
            }
            let jobs = list.jobs().to_vec();
            let chains = list.by_plane();
            for plane in 0..4 {
                let own = jobs
                    .iter()
                    .filter(|job| job.axis == Axis::Right || job.x & 3 == plane);
                let found: Vec<_> = chains.plane(plane).map(|job| job.texture).collect();
                assert_eq!(found, own.map(|job| job.texture).collect::<Vec<_>>());
            }
        }
    }
}
