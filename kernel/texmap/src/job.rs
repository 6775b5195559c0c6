//! Column jobs and the bounded list that holds them.

/// One column to draw: where, and what the mapper needs to walk its texture.
///
/// For every row i below `len`, `u + i du` and `v + i dv` lie inside the texture: the two end
/// values were clamped into it and the steps are cut towards zero, so nothing between can leave
/// it. No mapper clamps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ColumnJob {
    /// Screen column, 0 to 319.
    pub x: u16,
    /// First row, 0 to 239.
    pub y: u16,
    /// Rows, at least 1.
    pub len: u16,
    /// Which of the scene's textures.
    pub texture: u16,
    /// Texture coordinate across at the first pixel's centre, 16.16.
    pub u: i32,
    /// Texture coordinate down at the first pixel's centre, 16.16.
    pub v: i32,
    /// Step of `u` from a pixel to the one below, 16.16.
    pub du: i32,
    /// Step of `v` from a pixel to the one below, 16.16.
    pub dv: i32,
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
        u: 0,
        v: 0,
        du: 0,
        dv: 0,
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
