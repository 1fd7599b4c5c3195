//! Root of a function that changes sign once, jumps included.

/// A bracket `[below, above]` of where a function changes sign.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bracket {
    /// Where the function is still negative (or the lower end of the search).
    pub below: f32,
    /// Where the function is no longer negative (or the upper end of the search).
    pub above: f32,
}

/// Narrows `[low, high]` to the sign change of a function that is negative at `low` and not
/// negative at `high`, until the bracket is no wider than `width`.
///
/// Inverse quadratic interpolation where it is safe, bisection where it is not (Chandrupatla,
/// Advances in Engineering Software 28, 1997): a smooth function takes 6 to 9 evaluations,
/// one that jumps no more than [`MAX_EVALUATIONS`].
pub fn sign_change(
    function: impl FnMut(f32) -> f32,
    low: (f32, f32),
    high: (f32, f32),
    width: f32,
) -> Bracket {
    narrow(function, low, high, width, 0.5)
}

/// The same for a function that is nearly straight: the first guess takes it for straight.
pub fn straight_sign_change(
    function: impl FnMut(f32) -> f32,
    low: (f32, f32),
    high: (f32, f32),
    width: f32,
) -> Bracket {
    narrow(function, low, high, width, low.1 / (low.1 - high.1))
}

/// `fraction` of the bracket is the first guess.
fn narrow(
    mut function: impl FnMut(f32) -> f32,
    (low, value_low): (f32, f32),
    (high, value_high): (f32, f32),
    width: f32,
    mut fraction: f32,
) -> Bracket {
    // b is the newest point, a the other end of the bracket, c the point that left it
    let (mut a, mut fa) = (low, value_low);
    let (mut b, mut fb) = (high, value_high);
    for _ in 0..MAX_EVALUATIONS {
        let span = b - a;
        if span.abs() <= width {
            break;
        }
        // keep off the ends by half the wanted width, so that the bracket shrinks from both
        let margin = (0.5 * width / span.abs()).min(0.5);
        let x = a + fraction_within(fraction, margin) * span;
        let fx = function(x);
        let (c, fc);
        if (fx < 0.0) == (fa < 0.0) {
            (c, fc) = (a, fa);
        } else {
            (c, fc) = (b, fb);
            (b, fb) = (a, fa);
        }
        (a, fa) = (x, fx);
        let xi = (a - b) / (c - b);
        let phi = (fa - fb) / (fc - fb);
        let smooth = phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi;
        fraction = if smooth {
            fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
        } else {
            0.5
        };
    }
    if fa < 0.0 {
        Bracket { below: a, above: b }
    } else {
        Bracket { below: b, above: a }
    }
}

/// The most evaluations that [`sign_change`] makes.
pub const MAX_EVALUATIONS: usize = 32;

fn fraction_within(fraction: f32, margin: f32) -> f32 {
    // a NaN from a division by zero becomes the margin, which is always a valid step
    fraction.max(margin).min(1.0 - margin)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count(function: impl Fn(f32) -> f32, low: f32, high: f32, width: f32) -> (Bracket, usize) {
        let mut evaluations = 0;
        let bracket = sign_change(
            |x| {
                evaluations += 1;
                function(x)
            },
            (low, function(low)),
            (high, function(high)),
            width,
        );
        (bracket, evaluations)
    }

    #[test]
    fn smooth_functions_take_few_evaluations() {
        let (bracket, evaluations) = count(|x| x * x * x - 0.2, 0.0, 1.0, 1e-6);
        let root = 0.2_f32.powf(1.0 / 3.0);
        assert!(bracket.below <= root && root <= bracket.above);
        assert!(bracket.above - bracket.below <= 1e-6);
        assert!(evaluations <= 12, "{evaluations}");
    }

    #[test]
    fn a_jump_is_bracketed() {
        let (bracket, evaluations) =
            count(|x| if x < 0.3 { -1.0 - x } else { 7.0 }, 0.0, 1.0, 1e-6);
        assert!(bracket.below < 0.3 && 0.3 <= bracket.above);
        assert!(bracket.above - bracket.below <= 1e-6);
        assert!(evaluations < MAX_EVALUATIONS, "{evaluations}");
    }
}
