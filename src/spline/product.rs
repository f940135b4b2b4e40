//! The product of a warp's matrix with the controls' displacements: the one loop that runs in every frame.
//!
//! Lanes are vertices, and each vertex's sum runs over the controls in order, multiplying and then adding. Nothing is
//! fused or reassociated, so vectors of any width give the same bits. It runs at the pace at which memory delivers
//! the matrix; `docs/splines.md` says what wider vectors would bring.

/// Vertices worked on at once: three f32 accumulators of this length stay in the first-level cache.
const BLOCK: usize = 1024;

/// Controls added in one pass over a block, so that the accumulators are read and written a quarter as often.
const UNROLL: usize = 4;

/// Sets `out[v]` to Σⱼ shares\[j · V + v\] · q\[j\], V being the length of `out`.
///
/// `shares` holds V entries for each of `q`.
pub(super) fn multiply(shares: &[f32], q: &[[f32; 3]], out: &mut [[f32; 3]]) {
    let vertices = out.len();
    let mut sums = [[0.0_f32; BLOCK]; 3];
    for (block, out) in out.chunks_mut(BLOCK).enumerate() {
        let column = |j: usize| &shares[j * vertices + block * BLOCK..][..out.len()];
        let [x, y, z] = sums.each_mut().map(|sums| &mut sums[..out.len()]);
        x.fill(0.0);
        y.fill(0.0);
        z.fill(0.0);
        // What does not move adds nothing, to the bit: its column is not read.
        let mut moving = q.iter().enumerate().filter(|(_, q)| q.iter().any(|v| *v != 0.0));
        loop {
            let four: [_; UNROLL] = std::array::from_fn(|_| moving.next());
            if let [Some((a, p)), Some((b, q)), Some((c, r)), Some((d, s))] = four {
                add_four([column(a), column(b), column(c), column(d)], &[*p, *q, *r, *s], [x, y, z]);
                continue;
            }
            for (j, q) in four.into_iter().flatten() {
                add_one(column(j), *q, [x, y, z]);
            }
            break;
        }
        for (((out, x), y), z) in out.iter_mut().zip(x).zip(y).zip(z) {
            *out = [*x, *y, *z];
        }
    }
}

/// Adds four controls' displacements to a block, in order.
fn add_four(columns: [&[f32]; UNROLL], q: &[[f32; 3]; UNROLL], [x, y, z]: [&mut [f32]; 3]) {
    let [a, b, c, d] = columns;
    let columns = a.iter().zip(b).zip(c).zip(d);
    for ((((((a, b), c), d), x), y), z) in columns.zip(x).zip(y).zip(z) {
        *x = *x + a * q[0][0] + b * q[1][0] + c * q[2][0] + d * q[3][0];
        *y = *y + a * q[0][1] + b * q[1][1] + c * q[2][1] + d * q[3][1];
        *z = *z + a * q[0][2] + b * q[1][2] + c * q[2][2] + d * q[3][2];
    }
}

/// Adds one control's displacement to a block.
fn add_one(column: &[f32], q: [f32; 3], [x, y, z]: [&mut [f32]; 3]) {
    for (((share, x), y), z) in column.iter().zip(x).zip(y).zip(z) {
        *x += share * q[0];
        *y += share * q[1];
        *z += share * q[2];
    }
}
