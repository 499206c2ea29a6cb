//! COCO's run-length encoding of masks.
//!
//! Pixels are numbered column by column. The counts of runs alternate between 0 and 1, beginning
//! with 0. Compressed, from the third count on, each is written as its difference to the count two
//! before it, in groups of five bits from the lowest on, each in a character from `0` (48) on: bit
//! 5 says that more follow, bit 4 of the last group is the sign. Source: pycocotools,
//! `common/maskApi.c`, `rleToString`.

/// The compressed runs of a mask that is given by its pixels, numbered column by column, in
/// ascending order; `size` is the number of all pixels.
pub(crate) fn compress(pixels: impl IntoIterator<Item = usize>, size: usize) -> String {
    let mut counts: Vec<i64> = Vec::new();
    // Where the last run of ones ends.
    let mut end = 0;
    for pixel in pixels {
        match counts.last_mut() {
            Some(ones) if pixel == end => *ones += 1,
            _ => counts.extend([(pixel - end) as i64, 1]),
        }
        end = pixel + 1;
    }
    if end < size {
        counts.push((size - end) as i64);
    }
    let mut out = String::new();
    for (i, &count) in counts.iter().enumerate() {
        let mut rest = if i > 2 { count - counts[i - 2] } else { count };
        loop {
            let group = (rest & 0x1F) as u8;
            rest >>= 5;
            let sign = group & 0x10 != 0;
            let done = rest == if sign { -1 } else { 0 };
            out.push(char::from(48 + group + if done { 0 } else { 0x20 }));
            if done {
                break;
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The inverse, as pycocotools' `rleFrString` and `rleDecode` do it.
    fn decompress(text: &str, size: usize) -> Vec<usize> {
        let mut counts: Vec<i64> = Vec::new();
        let mut bytes = text.bytes();
        while bytes.len() > 0 {
            let (mut x, mut k) = (0_i64, 0);
            loop {
                let c = i64::from(bytes.next().expect("a group")) - 48;
                x |= (c & 0x1F) << (5 * k);
                k += 1;
                if c & 0x20 == 0 {
                    if c & 0x10 != 0 {
                        x |= -1 << (5 * k);
                    }
                    break;
                }
            }
            if counts.len() > 2 {
                x += counts[counts.len() - 2];
            }
            counts.push(x);
        }
        let (mut at, mut pixels) = (0, Vec::new());
        for (i, count) in counts.into_iter().enumerate() {
            let next = at + usize::try_from(count).expect("a count");
            if i % 2 == 1 {
                pixels.extend(at..next);
            }
            at = next;
        }
        assert_eq!(at, size);
        pixels
    }

    #[test]
    fn masks_come_back() {
        // A generator of its own, so that the masks are the same on every machine.
        let mut state = 7_u64;
        let mut draw = |n: u64| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 33) % n
        };
        for size in [1, 2, 7, 100, 5_000, 200_000] {
            for sparse in [1, 2, 50, 3_000] {
                let mut on = false;
                let mut pixels = Vec::new();
                for i in 0..size {
                    if draw(sparse) == 0 {
                        on = !on;
                    }
                    if on {
                        pixels.push(i);
                    }
                }
                assert_eq!(decompress(&compress(pixels.clone(), size), size), pixels);
            }
        }
        assert_eq!(compress([], 6), "6");
        assert_eq!(compress(0..6, 6), "06");
    }
}
