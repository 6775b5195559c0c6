//! Jobs: spans of pixels to draw.

use modex::{Column, Destination, Lane};

use crate::geometry::{Axis, Dropped, Texture};
use crate::loops::{
    AffineLoops, DrawQuotients, LineStepper, PixelSink, RowPixels, Rows, SpanPixels, Style,
};
use crate::mappers::adaptive::{self, AdaptivePieces};
use crate::mappers::coordinates::Coordinates;
use crate::mappers::linear::{self, DrawLinear};
use crate::mappers::pieces::Cuts;
use crate::mappers::{MappedSpan, Mapper, SpanKind, exact, quadratic};
use crate::plane::{Face, PlaneStepper, Tolerance};

/// Under [`Rows::Lines`], affine rows of fewer pixels are stepped instead. A line is first made in RAM, which
/// costs as much as selecting a plane about eight times. Most spans in a free direction are this short.
const SHORT_ROW: u16 = 8;

impl Style {
    /// Returns the functions that draw in this style on this CPU.
    pub(crate) fn functions(self) -> StyleFunctions {
        StyleFunctions {
            affine: AffineLoops::new(self.affine),
            linear: linear::drawing(self.affine),
            rows: self.rows,
            quotients: self.quotients.draw(),
        }
    }
}

/// The functions of a [`Style`], looked up once for many spans.
#[derive(Debug)]
pub(crate) struct StyleFunctions {
    affine: AffineLoops,
    /// Draws columns in linear pieces.
    linear: DrawLinear,
    rows: Rows,
    /// Draws the exact quotients of columns.
    quotients: DrawQuotients,
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
    pub kind: SpanKind,
}

impl Job {
    /// Returns the job of a mapper's span with a texture.
    pub(crate) fn new(span: MappedSpan, texture: u16) -> Self {
        let (x, y) = match span.axis {
            Axis::Down => (span.line, span.first),
            Axis::Right => (span.first, span.line),
        };
        Self {
            axis: span.axis,
            x,
            y,
            len: span.len,
            texture,
            kind: span.kind,
        }
    }

    /// Passes each pixel with its texture coordinates, 16.16, to `sink`: the reference implementation of
    /// [`Job::draw`]. Coordinates of the exact mapper are rounded down.
    pub fn pixels(&self, texture: &Texture<'_>, mut sink: impl FnMut((u16, u16), (i32, i32))) {
        let mut pixels = |job: &Self| {
            let mut coordinates = Coordinates::new(job.kind, job.len, texture);
            for i in 0..job.len {
                let place = job.place(i);
                sink(place, coordinates.next());
            }
        };
        let SpanKind::Adaptive(stepper, tolerance) = &self.kind else {
            return pixels(self);
        };
        let mut part = |first, len, kind| {
            let (x, y) = self.place(first);
            pixels(&Self {
                x,
                y,
                len,
                kind,
                ..*self
            });
        };
        let mut pieces = self.pieces(stepper, *tolerance, texture);
        for piece in pieces.by_ref() {
            part(piece.first, piece.len, SpanKind::Affine(piece.stepper));
        }
        if let Some((first, len, stepper)) = pieces.rest() {
            part(first, len, SpanKind::Exact(stepper));
        }
    }

    /// Passes each pixel, with the index in [`Texture::texels`] of the texel that it reads, to `sink`.
    ///
    /// ```
    /// use texmap::{Axis, Job, SpanKind, AffineStepper, Texture};
    ///
    /// let texture = Texture::new(&[7; 4 * 2], 4, 2)?;
    /// let stepper = AffineStepper { u: 1 << 16, v: 0, du: 1 << 15, dv: 1 << 16 };
    /// let kind = SpanKind::Affine(stepper);
    /// let job = Job { axis: Axis::Down, x: 20, y: 10, len: 2, texture: 0, kind };
    /// let mut reads = Vec::new();
    /// job.texels(&texture, |pixel, index| reads.push((pixel, index)));
    /// assert_eq!(reads, [((20, 10), 1), ((20, 11), 5)]);
    /// # Ok::<(), texmap::TextureError>(())
    /// ```
    pub fn texels(&self, texture: &Texture<'_>, mut sink: impl FnMut((u16, u16), usize)) {
        self.pixels(texture, |place, (u, v)| {
            sink(place, texture.index((u >> 16) as usize, (v >> 16) as usize));
        });
    }

    /// Returns the pieces of an adaptive span.
    #[inline]
    fn pieces(
        &self,
        stepper: &PlaneStepper,
        tolerance: Tolerance,
        texture: &Texture<'_>,
    ) -> AdaptivePieces {
        let row = (self.axis == Axis::Right).then_some(self.x);
        AdaptivePieces::new(stepper, self.len, row, tolerance, texture)
    }

    /// Returns whether the span stays in one column.
    pub fn is_column(&self) -> bool {
        self.axis == Axis::Down && !matches!(self.kind, SpanKind::FreeDirection(_))
    }

    /// Returns the job of the `len` pixels from pixel `first` of this span on.
    pub(crate) fn part(&self, first: u16, len: u16) -> Self {
        let (x, y) = self.place(first);
        Self {
            x,
            y,
            len,
            kind: self.kind.after(first),
            ..*self
        }
    }

    /// Returns the place (x, y) of pixel `i` of the span.
    #[inline]
    pub(crate) fn place(&self, i: u16) -> (u16, u16) {
        // Only a span in the free direction leaves its row or column.
        let offset = match &self.kind {
            SpanKind::FreeDirection(stepper) => stepper.offset_at(i),
            _ => 0,
        };
        match self.axis {
            Axis::Down => (self.x.wrapping_add_signed(offset), self.y + i),
            Axis::Right => (self.x + i, self.y.wrapping_add_signed(offset)),
        }
    }

    /// Draws the span.
    #[inline]
    pub fn draw(&self, style: Style, texture: &Texture<'_>, destination: &mut impl Destination) {
        self.draw_with(&style.functions(), texture, destination);
    }

    #[inline(always)]
    pub(crate) fn draw_with(
        &self,
        functions: &StyleFunctions,
        texture: &Texture<'_>,
        destination: &mut impl Destination,
    ) {
        if self.plane().is_some() {
            destination.select(self.x);
            self.draw_column(functions, texture, destination);
        } else {
            self.draw_other(functions, texture, destination);
        }
    }

    /// Draws a row, or a span in the free direction.
    #[inline(never)]
    fn draw_other(
        &self,
        functions: &StyleFunctions,
        texture: &Texture<'_>,
        destination: &mut impl Destination,
    ) {
        match &self.kind {
            SpanKind::FreeDirection(stepper) => self.each_line(stepper, |job| match job.axis {
                Axis::Down => {
                    destination.select(job.x);
                    job.draw_column(functions, texture, destination);
                }
                Axis::Right => job.draw_row(functions, texture, destination),
            }),
            _ => self.draw_row(functions, texture, destination),
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
            self.draw_in_plane_with(plane, &style.functions(), texture, destination);
        }
    }

    /// Returns the plane of a span that stays in its column. Any other span may have pixels in every plane.
    #[inline]
    pub(crate) fn plane(&self) -> Option<u16> {
        match (self.axis, &self.kind) {
            (Axis::Right, _) | (_, SpanKind::FreeDirection(_)) => None,
            (Axis::Down, _) => Some(self.x & 3),
        }
    }

    /// Draws the span's pixels that lie in `plane`, which must be selected. A column must lie in `plane`.
    #[inline(always)]
    pub(crate) fn draw_in_plane_with(
        &self,
        plane: u16,
        functions: &StyleFunctions,
        texture: &Texture<'_>,
        destination: &mut impl Destination,
    ) {
        if self.plane().is_some() {
            self.draw_column(functions, texture, destination);
        } else {
            self.draw_other_in_plane(plane, functions, texture, destination);
        }
    }

    /// Draws the pixels in `plane` of a row, or of a span in the free direction.
    #[inline(never)]
    fn draw_other_in_plane(
        &self,
        plane: u16,
        functions: &StyleFunctions,
        texture: &Texture<'_>,
        destination: &mut impl Destination,
    ) {
        match &self.kind {
            SpanKind::FreeDirection(stepper) => self.each_line(stepper, |job| match job.axis {
                Axis::Down if job.x & 3 != plane => {}
                Axis::Down => job.draw_column(functions, texture, destination),
                Axis::Right => job.draw_part(plane, functions, texture, destination),
            }),
            _ => self.draw_part(plane, functions, texture, destination),
        }
    }

    /// Passes the span in the free direction to `sink` as affine spans, each within one row or column.
    fn each_line(&self, stepper: &LineStepper, mut sink: impl FnMut(Self)) {
        let mut first = 0;
        while first < self.len {
            let len = stepper.pixels_in_line(first, self.len);
            let (x, y) = self.place(first);
            sink(Self {
                x,
                y,
                len,
                kind: SpanKind::Affine(stepper.texture.every(1, first.into())),
                ..*self
            });
            first += len;
        }
    }

    /// Draws a column, whose plane must be selected.
    #[inline(always)]
    fn draw_column(
        &self,
        functions: &StyleFunctions,
        texture: &Texture<'_>,
        destination: &mut impl Destination,
    ) {
        destination.lane(self.x, self.y, self.len, |column| match &self.kind {
            SpanKind::Affine(stepper) => (functions.affine.column)(texture, stepper, column),
            _ => self.fill(functions, texture, column),
        });
    }

    /// Draws the pixels of a column that is not affine.
    #[inline(never)]
    fn fill(&self, functions: &StyleFunctions, texture: &Texture<'_>, column: Column<'_>) {
        match &self.kind {
            SpanKind::Linear(stepper, pieces) => {
                (functions.linear)(texture, stepper, *pieces, functions.affine.column, column);
            }
            &SpanKind::Quadratic(stepper, pieces) => {
                quadratic::draw(texture, stepper, self.len, pieces, column);
            }
            &SpanKind::Exact(stepper) => exact::draw(texture, stepper, functions.quotients, column),
            SpanKind::Adaptive(stepper, tolerance) => {
                let pieces = self.pieces(stepper, *tolerance, texture);
                let loops = (functions.affine, functions.quotients);
                adaptive::draw::<1>(pieces, 0, texture, loops, column);
            }
            SpanKind::Upright(stepper) => stepper.column(texture, column),
            SpanKind::Affine(_) | SpanKind::FreeDirection(_) => {
                unreachable!("they are drawn elsewhere")
            }
        }
    }

    /// Draws a row.
    fn draw_row(
        &self,
        functions: &StyleFunctions,
        texture: &Texture<'_>,
        destination: &mut impl Destination,
    ) {
        match (functions.rows, self.kind) {
            (Rows::Multiply, SpanKind::Affine(stepper)) => {
                for i in 0..self.len {
                    let (u, v) = (
                        stepper.u + i32::from(i) * stepper.du,
                        stepper.v + i32::from(i) * stepper.dv,
                    );
                    destination.column(self.x + i, self.y, 1, |pixel| {
                        pixel.fill(|| texture.at(u, v));
                    });
                }
            }
            (rows, SpanKind::Affine(mut stepper))
                if rows == Rows::Steps || rows == Rows::Lines && self.len < SHORT_ROW =>
            {
                destination.row(self.x, self.y, self.len, || texel(texture, stepper.next()));
            }
            (Rows::Passes, _) => {
                for plane in 0..4u16 {
                    if plane.wrapping_sub(self.x) & 3 < self.len {
                        destination.select(plane);
                        self.draw_part(plane, functions, texture, destination);
                    }
                }
            }
            _ => destination.line(self.x, self.y, self.len, |line| {
                self.fill_row::<1>(0, functions, texture, RowPixels { line, x: self.x });
            }),
        }
    }

    /// Draws the pixels of a row in one plane, which must be selected.
    fn draw_part(
        &self,
        plane: u16,
        functions: &StyleFunctions,
        texture: &Texture<'_>,
        destination: &mut impl Destination,
    ) {
        let first = plane.wrapping_sub(self.x) & 3;
        if first < self.len {
            let len = (self.len - first).div_ceil(4);
            destination.lane(self.x + first, self.y, len, |row: Lane<'_, 1>| {
                self.fill_row::<4>(first, functions, texture, row);
            });
        }
    }

    /// Writes the texels of every `STRIDE`th pixel of a row, from pixel `first` on, to `pixels`.
    fn fill_row<const STRIDE: u16>(
        &self,
        first: u16,
        functions: &StyleFunctions,
        texture: &Texture<'_>,
        mut pixels: impl SpanPixels,
    ) {
        let len = (self.len - first).div_ceil(STRIDE);
        match &self.kind {
            SpanKind::Affine(stepper) => {
                let stepper = stepper.every(STRIDE.into(), first.into());
                functions.affine.fill(texture, stepper, pixels.part(0, len));
            }
            SpanKind::Exact(stepper) => {
                let stepper = stepper.every(STRIDE, first);
                exact::fill(texture, stepper, functions.quotients, &mut pixels, 0, len);
            }
            SpanKind::Adaptive(stepper, tolerance) => {
                let pieces = self.pieces(stepper, *tolerance, texture);
                let loops = (functions.affine, functions.quotients);
                adaptive::draw::<STRIDE>(pieces, first, texture, loops, pixels);
            }
            SpanKind::Linear(stepper, pieces) => {
                let mut cuts = Cuts::new(*stepper, self.len, *pieces, texture);
                let (mut place, mut skipped) = (0, first);
                while place < len {
                    let piece = cuts.next();
                    let count = piece.pixels.saturating_sub(skipped).div_ceil(STRIDE);
                    if count > 0 {
                        let stepper = piece.stepper().every(STRIDE.into(), skipped.into());
                        functions
                            .affine
                            .fill(texture, stepper, pixels.part(place, count));
                    }
                    place += count;
                    skipped = skipped + count * STRIDE - piece.pixels;
                }
            }
            _ => {
                let mut coordinates = Coordinates::new(self.kind, self.len, texture);
                (0..first).for_each(|_| _ = coordinates.next());
                pixels.part(0, len).fill(|| {
                    let (u, v) = coordinates.next();
                    (1..STRIDE).for_each(|_| _ = coordinates.next());
                    texture.at(u, v)
                });
            }
        }
    }
}

fn texel(texture: &Texture<'_>, coordinates: Option<(i32, i32)>) -> u8 {
    // A stepper never ends, so the default is never used.
    let (u, v) = coordinates.unwrap_or_default();
    texture.at(u, v)
}

impl Mapper {
    /// Passes the jobs that draw a face with `texture` to `sink`.
    ///
    /// # Errors
    /// If the polygon is outside the legal range; then `sink` has received no job.
    pub fn jobs(
        self,
        face: &Face<'_>,
        texture: &Texture<'_>,
        mut sink: impl FnMut(Job),
    ) -> Result<(), Dropped> {
        self.map(face, texture, &mut |span| {
            sink(Job::new(span, face.texture));
        })
    }
}
