//! From polygons to pixels: jobs are collected and drawn in polygon order.

use modex::Destination;

use crate::affine::Sides;
use crate::coverage::{Run, columns};
use crate::{ColumnJob, JobList, Plane, Texture, Vertex, Walk, affine, exact};

/// What was drawn, and what was not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stats {
    /// Polygons that were drawn (also those that cover no pixel).
    pub polygons: u32,
    /// Columns drawn.
    pub columns: u32,
    /// Pixels drawn.
    pub pixels: u32,
    /// Polygons outside the legal range, not drawn.
    pub dropped: u32,
    /// Times that the job list was full and had to be drawn before the picture was complete.
    pub full: u32,
}

/// How a polygon's texture coordinates are found.
#[derive(Clone, Copy, Debug)]
pub enum Mapping<'a> {
    /// Affine, from the vertices' own: [`Sides::walk`].
    Affine,
    /// Affine by chapter 57's half steps: [`Sides::half_step`].
    HalfStep,
    /// With the perspective of the texture's plane: [`exact`].
    Exact(&'a Plane),
}

/// Draws polygons on a destination through a bounded list of jobs.
#[derive(Debug)]
pub struct Renderer<'a, D, const N: usize> {
    jobs: &'a mut JobList<N>,
    textures: &'a [Texture<'a>],
    destination: &'a mut D,
    stats: Stats,
}

impl<'a, D: Destination, const N: usize> Renderer<'a, D, N> {
    /// A renderer for one picture; whatever was in `jobs` is forgotten.
    pub fn new(
        jobs: &'a mut JobList<N>,
        textures: &'a [Texture<'a>],
        destination: &'a mut D,
    ) -> Self {
        jobs.clear();
        Self {
            jobs,
            textures,
            destination,
            stats: Stats::default(),
        }
    }

    /// Adds a polygon with the texture `textures[texture]`.
    ///
    /// # Panics
    /// If there is no such texture.
    pub fn polygon(&mut self, polygon: &[Vertex], texture: u16, mapping: Mapping<'_>) {
        let Self {
            jobs,
            textures,
            destination,
            stats,
        } = self;
        let mut add = |run: Run, walk| {
            let job = ColumnJob {
                x: run.line,
                y: run.first,
                len: run.len,
                texture,
                walk,
            };
            if let Err(job) = jobs.push(job) {
                stats.full += 1;
                draw(jobs, textures, *destination, stats);
                // A list that was just emptied takes the job: N is not zero.
                let _ = jobs.push(job);
            }
        };
        let sides = || Sides::new(polygon, &textures[usize::from(texture)]);
        let scanned = match mapping {
            Mapping::Affine => sides()
                .and_then(|sides| columns(polygon, |run| add(run, Walk::Affine(sides.walk(&run))))),
            Mapping::HalfStep => sides().and_then(|sides| {
                columns(polygon, |run| add(run, Walk::Affine(sides.half_step(&run))))
            }),
            Mapping::Exact(plane) => columns(polygon, |run| {
                let walk = exact::Walk::new(plane, run.line, run.first);
                add(run, Walk::Exact(walk));
            }),
        };
        match scanned {
            Ok(()) => stats.polygons += 1,
            Err(_) => stats.dropped += 1,
        }
    }

    /// Counts a polygon that could not even be placed on the screen.
    pub fn drop_polygon(&mut self) {
        self.stats.dropped += 1;
    }

    /// Draws what is left and says what the picture took.
    pub fn finish(mut self) -> Stats {
        draw(self.jobs, self.textures, self.destination, &mut self.stats);
        self.stats
    }
}

/// Draws the jobs in their order and empties the list.
fn draw<D: Destination, const N: usize>(
    jobs: &mut JobList<N>,
    textures: &[Texture<'_>],
    destination: &mut D,
    stats: &mut Stats,
) {
    const { assert!(N > 0, "a job list needs room for a job") };
    for job in jobs.jobs() {
        stats.columns += 1;
        stats.pixels += u32::from(job.len);
        let texture = &textures[usize::from(job.texture)];
        destination.column(job.x, job.y, job.len, |column| match &job.walk {
            Walk::Affine(walk) => affine::column(texture, walk, column),
            Walk::Exact(walk) => exact::column(texture, *walk, job.len, column),
        });
    }
    jobs.clear();
}
