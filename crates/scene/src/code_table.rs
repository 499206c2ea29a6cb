//! From light to the code values of pictures and textures of eight bits.

/// Light below 2^-14 is coded like 0 by the tables' first cell, or counted on from there.
const FIRST_EXPONENT: u32 = 127 - 14;
/// Cells go up to 2^6; all light above has the last cell's code, or a greater one.
const OCTAVES: u32 = 20;
/// Cells are 1/128 of an octave wide, which is a number of bits of the mantissa. A cell of the sRGB
/// curve has at most one step.
const CELL_BITS: u32 = 7;

/// Maps light to code values 0..=255, exactly and fast, by the least light of each code value.
#[derive(Clone, Debug)]
pub struct CodeTable {
    /// The least light of each code value but 0; of one more, which no light has.
    least: [f32; 256],
    /// The code at the lower end of each cell.
    starts: Vec<u8>,
    /// The most steps from a code to the next one in a cell.
    steps: u8,
}

impl CodeTable {
    /// The table of a curve. Light of x has the greatest code value that is at most `code(x)`,
    /// which must not decrease from 0 to `most` (at most 64), where it must reach 255.
    #[must_use]
    pub fn new(most: f32, code: impl Fn(f32) -> f64) -> Self {
        let least: [f32; 256] = std::array::from_fn(|i| {
            if i == 255 {
                return f32::NAN;
            }
            // Non-negative floats are ordered like their bits, so bisect the bits.
            let (mut low, mut high) = (0, most.to_bits());
            while high - low > 1 {
                let middle = low + (high - low) / 2;
                if code(f32::from_bits(middle)) >= (i + 1) as f64 {
                    high = middle;
                } else {
                    low = middle;
                }
            }
            f32::from_bits(high)
        });
        let start = |cell: u32| {
            let low = ((FIRST_EXPONENT << CELL_BITS) + cell) << (23 - CELL_BITS);
            least[..255].partition_point(|&least| least <= f32::from_bits(low)) as u8
        };
        let mut starts: Vec<u8> = (0..OCTAVES << CELL_BITS).map(start).collect();
        // All light below the table is found here, too.
        starts[0] = 0;
        let ends = starts.iter().skip(1).chain([&255]);
        let steps = starts.iter().zip(ends).map(|(start, end)| end - start);
        Self {
            least,
            steps: steps.max().unwrap_or(0),
            starts,
        }
    }

    /// The code value of light; 0 for what is no number.
    #[inline]
    #[must_use]
    pub fn code(&self, light: f32) -> u8 {
        // The exponent and the mantissa's first bits almost determine the code; the rest is
        // counted.
        let bits = light.max(0.0).to_bits() >> (23 - CELL_BITS);
        let cell = bits.saturating_sub(FIRST_EXPONENT << CELL_BITS);
        let mut code = self.starts[(cell as usize).min(self.starts.len() - 1)];
        // Whether there is a step is unforeseeable, so it is added rather than branched on.
        for _ in 0..self.steps {
            code += u8::from(self.least[usize::from(code)] <= light);
        }
        code
    }

    /// For each code value but 0 the least light that has it.
    #[must_use]
    pub fn least(&self) -> &[f32] {
        &self.least[..255]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn table(power: f32) -> CodeTable {
        CodeTable::new(1.0, move |x| f64::from(x.powf(power)) * 255.0 + 0.5)
    }

    proptest! {
        /// The oracle: the number of code values whose least light is not above.
        #[test]
        fn a_code_is_that_of_a_search(bits: u32, power in 0.3_f32..3.0, which in 0_usize..255) {
            let table = table(power);
            let searched = |x: f32| table.least().iter().filter(|&&least| least <= x).count();
            let least = table.least[which];
            let below = f32::from_bits(least.to_bits() - 1);
            for light in [f32::from_bits(bits), least, below, least * 0.999] {
                prop_assert_eq!(usize::from(table.code(light)), searched(light), "{}", light);
            }
        }
    }

    #[test]
    fn ends() {
        let table = table(1.0 / 2.4);
        for dark in [0.0, -0.0, -1.0, f32::MIN, f32::NEG_INFINITY, f32::NAN] {
            assert_eq!(table.code(dark), 0, "{dark}");
        }
        for bright in [1.0, 63.0, 1e9, f32::MAX, f32::INFINITY] {
            assert_eq!(table.code(bright), 255, "{bright}");
        }
    }
}
