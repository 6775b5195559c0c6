//! The affine column mapper: texture coordinates stepped down the column in 16.16.
//!
//! Legal input: a job as coverage makes it (its ends inside the texture). Error against the
//! exact affine coordinates: the step is cut to 2^-16 texel towards zero, so after n pixels the
//! coordinate is off by less than n 2^-16 texel, at most 0.0037 over 240.

use modex::Column;

use crate::{ColumnJob, Texture};

/// Draws one column of `job` from `texture`.
#[inline]
pub fn column(texture: &Texture<'_>, job: &ColumnJob, column: Column<'_>) {
    let texels = texture.texels();
    let width = usize::from(texture.width());
    let (mut u, mut v) = (job.u, job.v);
    column.fill(|| {
        let texel = texels[(v >> 16) as usize * width + (u >> 16) as usize];
        // The last addition steps past the column; |u| and |du| are below 2^25, so it fits.
        u += job.du;
        v += job.dv;
        texel
    });
}
