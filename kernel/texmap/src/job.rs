//! Column jobs and the bounded list that holds them.

use crate::{affine, exact};

/// How a column's texture is walked: starts and steps, one mapper's or another's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Walk {
    /// [`affine`].
    Affine(affine::Walk),
    /// [`exact`].
    Exact(exact::Walk),
}

/// One column to draw: where, and what the mapper needs to walk its texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ColumnJob {
    /// Screen column, 0 to 319.
    pub x: u16,
    /// First row, 0 to 239.
    pub y: u16,
    /// Rows, at least 1.
    pub len: u16,
    /// Which of the scene's textures.
    pub texture: u16,
    /// Its walk.
    pub walk: Walk,
}

/// A list of at most `N` jobs, without a heap.
#[derive(Clone, Debug)]
pub struct JobList<const N: usize> {
    jobs: [ColumnJob; N],
    len: usize,
}

impl<const N: usize> JobList<N> {
    const EMPTY: ColumnJob = ColumnJob {
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
    pub fn push(&mut self, job: ColumnJob) -> Result<(), ColumnJob> {
        let place = self.jobs.get_mut(self.len).ok_or(job)?;
        *place = job;
        self.len += 1;
        Ok(())
    }

    /// The jobs, in the order in which they came.
    pub fn jobs(&self) -> &[ColumnJob] {
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
