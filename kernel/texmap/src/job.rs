//! Jobs: runs of pixels to draw, and the bounded list that holds them.

use modex::Destination;

use crate::coverage::Axis;
use crate::loops::Loop;
use crate::runs::{self, Pieces, Steps};
use crate::{Texture, affine, exact, free, level, plane};

/// How a run's texture is walked: starts and steps, one mapper's or another's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Walk {
    /// [`affine`].
    Affine(affine::Walk),
    /// [`exact`].
    Exact(plane::Walk),
    /// [`Steps::linear`].
    Linear(plane::Walk, Pieces),
    /// [`Steps::quadratic`].
    Quadratic(plane::Walk, Pieces),
    /// [`level`]: one coordinate stays.
    Wall(level::Wall),
    /// [`free`]: the run leaves its row or column.
    Free(free::Walk),
}

/// How the pixels of a row are reached.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rows {
    /// Address, plane and texel anew for every pixel.
    Multiply,
    /// Stepped, the plane selected for every pixel.
    #[default]
    Steps,
    /// In four passes, one a plane.
    Passes,
}

/// How runs are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Style {
    /// The loop for affine columns.
    pub affine: Loop,
    /// For rows.
    pub rows: Rows,
}

/// One run to draw: where, and what the mapper needs to walk its texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Job {
    /// Down a column or along a row.
    pub axis: Axis,
    /// The first pixel's column, 0 to 319.
    pub x: u16,
    /// Its row, 0 to 239.
    pub y: u16,
    /// Pixels, at least 1.
    pub len: u16,
    /// Which of the scene's textures.
    pub texture: u16,
    /// Its walk.
    pub walk: Walk,
}

impl Job {
    /// The run of `len` pixels from pixel `first` of column or row `line`.
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

    /// Each pixel with its coordinates in the texture, 16.16: the clear twin of [`Job::draw`].
    /// The exact mapper's are rounded down.
    pub fn pixels(&self, texture: &Texture<'_>, mut sink: impl FnMut((u16, u16), (i32, i32))) {
        let mut coordinates = Coordinates::new(self, texture);
        for i in 0..self.len {
            let place = self.place(i);
            sink(place, coordinates.next());
        }
    }

    /// Where pixel `i` of the run is.
    #[inline]
    fn place(&self, i: u16) -> (u16, u16) {
        let aside = match &self.walk {
            Walk::Free(walk) => walk.aside(i),
            _ => 0,
        };
        match self.axis {
            Axis::Down => (self.x.wrapping_add_signed(aside), self.y + i),
            Axis::Right => (self.x + i, self.y.wrapping_add_signed(aside)),
        }
    }

    /// Draws the run.
    pub fn draw(&self, style: Style, texture: &Texture<'_>, destination: &mut impl Destination) {
        match (self.walk, self.axis) {
            (Walk::Free(walk), _) => {
                self.straight(&walk, |job| job.draw(style, texture, destination));
            }
            (_, Axis::Down) => {
                destination.select(self.x);
                self.draw_column(style, texture, destination);
            }
            (_, Axis::Right) => self.draw_row(style, texture, destination),
        }
    }

    /// Draws those of the run's pixels that lie in `plane`, which is selected.
    pub fn draw_in_plane(
        &self,
        plane: u16,
        style: Style,
        texture: &Texture<'_>,
        destination: &mut impl Destination,
    ) {
        match (self.walk, self.axis) {
            (Walk::Free(walk), _) => self.straight(&walk, |job| {
                job.draw_in_plane(plane, style, texture, destination);
            }),
            (_, Axis::Down) if self.x & 3 != plane => {}
            (_, Axis::Down) => self.draw_column(style, texture, destination),
            (_, Axis::Right) => self.draw_part(plane, texture, destination),
        }
    }

    /// The run in the free direction as affine runs, each within its row or column.
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

    /// A column, its plane selected.
    fn draw_column(&self, style: Style, texture: &Texture<'_>, destination: &mut impl Destination) {
        destination.lane(self.x, self.y, self.len, |column| match self.walk {
            Walk::Affine(walk) => style.affine.column(texture, walk, column),
            Walk::Exact(walk) => exact::column(texture, walk, self.len, column),
            Walk::Wall(wall) => wall.column(texture, column),
            Walk::Linear(walk, pieces) => {
                runs::linear(texture, walk, self.len, pieces, style.affine, column);
            }
            Walk::Quadratic(walk, pieces) => {
                runs::quadratic(texture, walk, self.len, pieces, column);
            }
            Walk::Free(_) => unreachable!("it is no column"),
        });
    }

    /// A row.
    fn draw_row(&self, style: Style, texture: &Texture<'_>, destination: &mut impl Destination) {
        match (style.rows, self.walk) {
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
            (Rows::Passes, Walk::Affine(_)) => {
                for plane in 0..4u16 {
                    let first = plane.wrapping_sub(self.x) & 3;
                    if first < self.len {
                        destination.select(plane);
                        self.draw_part(plane, texture, destination);
                    }
                }
            }
            _ => {
                let mut coordinates = Coordinates::new(self, texture);
                destination.row(self.x, self.y, self.len, || {
                    texel(texture, Some(coordinates.next()))
                });
            }
        }
    }

    /// The pixels of a row in one plane, which is selected.
    fn draw_part(&self, plane: u16, texture: &Texture<'_>, destination: &mut impl Destination) {
        let first = plane.wrapping_sub(self.x) & 3;
        match self.walk {
            Walk::Affine(walk) => {
                if first < self.len {
                    let mut walk = walk.every(4, first.into());
                    let len = (self.len - first).div_ceil(4);
                    destination.lane::<1>(self.x + first, self.y, len, |row| {
                        row.fill(|| texel(texture, walk.next()));
                    });
                }
            }
            _ => {
                let mut coordinates = Coordinates::new(self, texture);
                for i in 0..self.len {
                    let (u, v) = coordinates.next();
                    let x = self.x + i;
                    if x & 3 == plane {
                        destination
                            .lane::<1>(x, self.y, 1, |pixel| pixel.fill(|| texture.at(u, v)));
                    }
                }
            }
        }
    }
}

fn texel(texture: &Texture<'_>, coordinates: Option<(i32, i32)>) -> u8 {
    // Walks have no end.
    let (u, v) = coordinates.unwrap_or_default();
    texture.at(u, v)
}

/// A run's coordinates, pixel after pixel.
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
#[derive(Clone, Debug)]
pub struct JobList<const N: usize> {
    jobs: [Job; N],
    len: usize,
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

    /// An empty list.
    pub const fn new() -> Self {
        Self {
            jobs: [Self::EMPTY; N],
            len: 0,
        }
    }

    /// Adds a job, unless the list is full.
    ///
    /// # Errors
    /// The job, when there is no room for it.
    pub fn push(&mut self, job: Job) -> Result<(), Job> {
        let place = self.jobs.get_mut(self.len).ok_or(job)?;
        *place = job;
        self.len += 1;
        Ok(())
    }

    /// The jobs, in the order in which they came.
    pub fn jobs(&self) -> &[Job] {
        &self.jobs[..self.len]
    }

    /// Empties the list.
    pub fn clear(&mut self) {
        self.len = 0;
    }
}

impl<const N: usize> Default for JobList<N> {
    fn default() -> Self {
        Self::new()
    }
}
