"""Why mutants survive: (mutant's name, change from => to, reason), as regular expressions; the first that fits is taken."""

from __future__ import annotations


def only(old: str, new: str) -> str:
    """The pattern of a change of this alone, the rest of the line being as it was."""
    return rf"^(?P<before>.*){old}(?P<after>.*) => (?P=before){new}(?P=after)$"


EXPLANATIONS: tuple[tuple[str, str, str], ...] = (
    ("", only("axis=-1", r"axis=\+1"), "Equivalent: of two axes the last is the second."),
    (
        "powder.x__coarse",
        r"common_shape\(\*fields, \*shares\)",
        "Equivalent: a backing that does not fit is refused by `over`, in the same words.",
    ),
    ("arrays.x__real", r"XXfiubXX", "Equivalent: numpy has no kind of dtype called X."),
    (
        "arrays.x_(doubles|floats)",
        r"copy=|float64, \)",
        "Equivalent: only whether an array is copied that nobody writes to.",
    ),
    (
        "arrays.x_in_blocks",
        r"inputs\[1\]|block\[1\]",
        "Equivalent: all inputs have one dtype, and all parts of a block one length.",
    ),
    (
        "arrays.x_in_blocks",
        r"flags|op_dtypes",
        "Equivalent: what numpy does by itself where inputs have one dtype and results are to be allocated.",
    ),
    (
        "inversion.x_free_film",
        r"np\.clip\(R, 0, (None|2)\)|tiny, (None|2)\)|np\.clip\(T, None, 1\)|np\.clip\(A, 0, (None|2)\)",
        "Equivalent in effect: what is above 1 by more than the slack of 1e-5, or a T below the least, is refused before.",
    ),
    (
        "microfacets.x_kelemen_albedo",
        only(r"np\.clip\(cos_view, 0, 1\)", r"np\.clip\(cos_view, (?:None, 1|0, 2|0, None)\)"),
        "Equivalent in effect: what is outside by more than the slack of 1e-5 is refused before.",
    ),
    (
        "microfacets.x_kelemen_albedo",
        r"_ALBEDOS.* => .*(slice\(|albedo\.size, \))",
        "Equivalent: only how many directions are worked at a time.",
    ),
    (
        "microfacets.x_kelemen",
        r"common_shape.*\[\.\.\., 1\]|flat\[1\]\.size",
        "Equivalent: all components of a direction, and all values that are spread to one shape, have one.",
    ),
    (
        "fitting.x__scaled_to_noise",
        only(r"max\(freedom, 1\)", r"max\(freedom, 2\)"),
        "Equivalent: a prior needs three wavelengths, so the freedom is 3 or more.",
    ),
    (
        "fitting.x__minimise_smooth",
        only(r"1e-11 \* cost", "1e-11 / cost"),
        "When the descent stops, not where: it begins at the best of each wavelength, where the cost is of the order of 1.",
    ),
    (
        "fitting.x__scaled_to_noise",
        only(r"weight\[0\]", r"weight\[1\]"),
        "Equivalent: a wavelength has weight in all films or in none.",
    ),
    (
        "fitting.x__starts",
        r"np\.full\(None, np\.inf\)|np\.zeros\(None\)",
        "Equivalent: numpy takes None for a shape of no axes, and a single number stands for as many alike.",
    ),
    (
        "fitting.x_invert_films",
        only(r"1e9\)", r"1000000001\.0\)"),
        "A convention: where it ends what is taken for a smoothness; a prior that loose is none from 1e3 on.",
    ),
    ("fitting.x__prepare", r"R_g\[1\]|X\[1\]", "Equivalent: all are alike where all are like any one of them."),
    (
        "fitting.x__minimise",
        r"settled = None|np\.abs\(cost \+ new|np\.all\(None\)|np\.where\(better, None, damping >=|damping > _GREATEST",
        "Equivalent: the descent does not count as settled then, so that it takes all of its rounds.",
    ),
    (
        "fitting.x__minimise__",
        r"^(settled|moved) = ",
        "When the descent stops, not where: the rounds before have brought it there to the last digits.",
    ),
    (
        "fitting.x__minimise",
        r"^damping = ",
        "The way of the descent, not its end: how fast the damping rises or falls, or how far.",
    ),
    (
        "fitting.x__minimise__",
        r"^longest = ",
        "The way of the descent, not its end: where a long step is cut, or how.",
    ),
    (
        "fitting.x__minimise_smooth",
        r"^step /= .* => step \*= ",
        "The way of the descent, not its end: a long step, here made longer, is refused and damped where the fit gets worse.",
    ),
    (
        "fitting.x__minimise_smooth",
        only(r", low, high\)", r", (?:None, high|low, None)\)"),
        "Equivalent in effect: `_judge` holds K and S to the limits again, which are far from all that readings can tell.",
    ),
    (
        "fitting.x__thinnest_hiding",
        only(r"np\.isinf\(X\), 1, X", r"np\.isinf\(X\), 2, X"),
        "A convention: films that all are opaque, of no known thickness, tell the ratio of K and S alone.",
    ),
    (
        "fitting.x__minimise_smooth",
        r"^step /= ",
        "The way of the descent, not its end: where a long step is cut; with axis=None that of all spectra by the longest of all.",
    ),
    (
        "fitting.x__minimise_smooth",
        r"np\.sum\(bend\*\*2, (axis=None)?\)|reshape\(-1, \)|sum\(axis=None\)",
        "The way of the descent, not its end: the cost only tells whether a step is taken; here that of one spectrum has a part "
        "of the others', and the step that makes its own least does so still.",
    ),
    (
        "fitting.x__minimise__",
        r"^trial = .*, low, high\) => trial = .*, (None, high|low, None)\)$|, low, high\) => .*, None, high\)$",
        "Equivalent: `_judge` holds K and S to the limits again; what is below lets all light through, what is above none.",
    ),
    (
        "fitting.x__judge",
        r"np\.clip\(theta, None, high\)|np\.clip\(theta, low, None\)",
        "Equivalent: the descents end within those limits.",
    ),
    ("fitting.x__judge", only("1e150", r"1e\+150"), "Equivalent: 1e150 + 1 is 1e150."),
    (
        "fitting.x__judge",
        only(r"noise_weight = np\.ones_like\(chi\)", r"noise_weight = np\.ones_like\(None\)"),
        "Equivalent: numpy makes a single 1 of None, and one 1 divides as many do.",
    ),
    ("fitting.x__covariance", r"shape\[(-2|\+1)\]", "Equivalent: the matrices are square."),
    (
        "fitting.x__covariance",
        r"-= 1e-12",
        "Rounding only: a millionth of a millionth of the diagonal, more or less, keeps a matrix from being singular.",
    ),
    (
        "fitting.x__minimise_smooth",
        r"damped.* -= 1e-12",
        "Rounding only: a number that small, more or less, keeps a matrix without readings from being singular.",
    ),
    (
        "fitting.x__prepare",
        r"R > -slack|R < 1 \+ slack|X > THINNEST",
        "Differs only at the very border of what the noise excuses, or of the thinnest film; either answer is right there.",
    ),
    (
        "fitting.x__minimise_smooth",
        only(r"cost = np\.where\(better, ", r"cost = np\.where\(None, "),
        "The way of the descent, not its end: after a step that is refused, the next is measured against it and not the best.",
    ),
    (
        "fitting.x__starts",
        only(r"all\(axis=0\), 0, ", r"all\(axis=0\), 1, "),
        "Where all films are opaque the descents start at another scale, of which such films tell nothing.",
    ),
    (
        "fitting.x__starts",
        only(r"ratio \+ 2", r"ratio \+ 3"),
        "Where the descents start, not their end: films a little thinner.",
    ),
    (
        "fitting.x__best_descent",
        only(r"np\.zeros\(\(2, m\)\)", r"np\.zeros\(None\)"),
        "Equivalent: the first descent is taken whole in its place, any cost being less than infinite.",
    ),
    (
        "fitting.x__(step|minimise_smooth)",
        r"1 \+ damping.* => .*1 - damping|\*= 1 \+ damping.* => .*/= 1 \+ damping|kk \* \(1 \+ damping\).* => .*kk / \(1 \+ damping\)",
        "The way of the descent, not its end: steps a little too long instead of too short; those that make the fit worse are refused.",
    ),
    (
        "fitting.x__best_descent",
        only(r"np\.full\(m, ", r"np\.full\(None, "),
        "Equivalent: numpy takes None for a shape of no axes, and a single number stands for as many alike.",
    ),
    (
        "fitting.x__(judge|thinnest_hiding)",
        only(r"np\.finfo\(np\.float64\)", r"np\.finfo\(None\)"),
        "Equivalent: numpy takes None for float64.",
    ),
    (
        "fitting.x__limits",
        r"np\.isinf\(data\.X\), 1, data\.X",
        "The limits only: beside an opaque film those of K and S are then of a film of at least 1 mm, still far past what can be told.",
    ),
    (
        "fitting.x__model",
        r"np\.where\((None|opaque), [12], data\.X\)$",
        "Equivalent: what the model of thin films gives of an opaque one is masked.",
    ),
    ("powder.x_powder_difference", r"Rg, None", "Equivalent: what is not FINE is COARSE."),
    ("powder.x__coarse", r"fractions, None", "Equivalent: the backing gives no other dtype than the fractions have."),
    (
        "",
        only(", strict=True", ", (?:strict=None|strict=False)?"),
        "Equivalent: what is walked over together has one length.",
    ),
    (
        "",
        only(
            r"(?P<given>np\.where\((?:x != 0|d > 0|z > 0|total > 0|far|y > 0\.03|contrast > 0|determined|seen|good)\b.*, )1\)",
            r"(?P=given)2\)",
        ),
        "Equivalent: what stands in for a divisor of 0 is masked or multiplied by 0 afterwards.",
    ),
    (
        "fitting.x__prepare",
        only(r"np\.where\(bad, (?:0\.5|1), ", r"np\.where\(bad, (?:1\.5|2), "),
        "Equivalent: stands in, without weight, where a reading is none; K, S and status are set there in any case.",
    ),
    (
        "fitting.x__minimise__",
        only(r"theta = np\.clip\(theta, low, high\)", r"theta = np\.clip\(theta, low, None\)"),
        "Equivalent in effect: the starts are far below the greatest K and S, and every step is held to them.",
    ),
    (
        r"optics\.(?!fitting)",
        only(r"(?P<given>np\.where\((?:bad|hidden), )(?:0\.5|1), ", r"(?P=given)(?:1\.5|2), "),
        "Equivalent or masked: stands in where the reading is refused; K, S and status are set there in any case.",
    ),
    (
        "sensitivity.x__tanhc_slope",
        r"series|y >= 0",
        "Below what is asked: the last terms of a series change by a thousandth of themselves, 1e-9 of a derivative that "
        "serves for errors and steps; or both forms hold at the border.",
    ),
    (
        "films",
        r"out=\w+\) => .*(out=None\)|, \))",
        "Equivalent: only whether a result takes the place of another.",
    ),
    ("films", r"in_blocks\(\w+, \d, \d", "Equivalent: only how many arrays to work in are made, one more than needed."),
    (
        "films.x__far",
        r"3 \* S\)|infinite, 1, X",
        "How thick counts as infinite: any bound between what lets no light through and what overflows does.",
    ),
    ("films.x__film", r"far, 1, X", "Equivalent: the value is masked, the opaque film is written over it."),
    ("films.x__lay|films.x__over", r"d -= d", "Equivalent: between two mirrors no light is divided, by 1 or by -1."),
    ("films.x__put_opaque", r"total = |or A is not", "Equivalent: masked; T and A are given both or neither."),
    (
        "films.x__lay",
        r"where=much\) =>",
        "Equivalent: both forms of the denominator are right where the parts of a stack add up to 1.",
    ),
    (
        "fitting.x__prepare",
        r'\("r", R\)|\("XXRXX", R\)',
        "Equivalent: the name stands in a message that the readings themselves cannot call for.",
    ),
    ("films.x_as_stack", r"short\(None\)", "The message only."),
    ("fitting.x__like_readings", r"R\.shape\[1\]|R\.ndim", "The message only."),
    (
        "fitting.x__judge",
        r"^(.*)\+ 16 \* rounding => \1(\+ 17|- 16) \* rounding$",
        "How many roundings count as none: 16, 17, or where there is noise less than its own part.",
    ),
    ("films.x_stack", r"np\.(zeros|ones)\(None", "Equivalent: numpy takes None for a shape of no axes."),
    ("films.x_opaque_reflectance", r"np\.zeros", "Equivalent: the dtype of a number that is only compared."),
    (
        "interfaces.x_saunderson",
        r"floats\(None",
        "Equivalent with numpy 1; with numpy 2 the test of dtypes finds it.",
    ),
    ("films.x_lay", r"bounce <= 0\.5", "Equivalent: both forms are exact at the border."),
    ("films.x_stack", r"index == 0", "Equivalent: laying on nothing is exactly the identity; the branch saves time."),
    ("arrays", r"BLOCK|buffersize|shape or", "Equivalent: only how much is worked at a time."),
    (
        "films",
        r"finfo.*max|/ 16|/ 17|1 \+ K \+ S|2 \+ K \+ S",
        "How far below overflow a thickness counts as infinite: any value does, the film is opaque long before.",
    ),
    (
        "films",
        r"initial=",
        "Equivalent: the start of a minimum or maximum over values that are never below 0, needed for empty arrays only.",
    ),
    ("films", r"tiny", "Equivalent: any number so small gives sinh(z)/z = 1 and cosh z = 1."),
    (
        "arrays",
        r"external_loop|buffered",
        "Equivalent: only how numpy walks over the arrays.",
    ),
    (
        "interfaces",
        r"m <= 4|m, 5\)",
        "Equivalent: quadrature and closed form agree to the last digits at the border, or the value is not used.",
    ),
    ("interfaces", r"index > 1", "Equivalent: at n = 1 both sides reflect nothing."),
    ("interfaces", r"1 - _NODES", "Equivalent: Gauss-Legendre nodes are symmetric."),
    ("interfaces|inversion|microfacets", r"MakeupError\(None|XX", "The message only."),
    (
        "inversion",
        only(r"sigma\[\d\]", r"sigma\[\d\]"),
        "Equivalent in effect: the tolerance matters only where the two readings are alike, and then so are their deviations.",
    ),
    (
        "inversion.x_(invert|_readings)",
        r"np\.where\(bad, None, |np\.where\(None, 0\.5, value\)\.astype\(value\.dtype\) for value in inner",
        "Equivalent: what stands in for a thickness or reading that is none is masked by its status.",
    ),
    ("inversion", only(r"4 \* np\.finfo", r"5 \* np\.finfo"), "How many roundings count as equal: 4 or 5."),
    ("inversion.x__inversion", r"^(.*)-([bc] \* inverse.*) => \1\+\2$", "Equivalent: only absolute values are used."),
    (
        "inversion|fitting.x__judge",
        r"^Status\.OK, => $|^(.*), 0\) => \1, \)$",
        "Equivalent: 0 is the default of np.select, and Status.OK is 0.",
    ),
    (
        "inversion",
        r"np\.clip\(R_0, 0, (None|2)\)",
        "Equivalent: R0 above 1 needs a reading above 1, which is refused before.",
    ),
    (
        "inversion.x__readings",
        r"value > 0|value < 1|<= 2",
        "Differs for a reading that is internally 0 or 1 to the last digit, or above 1, which the raw readings exclude.",
    ),
    (
        "inversion.x_invert_",
        only(r"u \* black, 0\)", r"u \* black, 1\)"),
        "Equivalent: masked by the selection that follows.",
    ),
    (
        r"optics\.(?!fitting)",
        r"astype\(None\)|dtype=None|astype\(given\[1\]",
        "Equivalent: None means float64 there, or the dtype is the same.",
    ),
    (
        "microfacets",
        r"cos_d >= 0|cos_light >= 0",
        "Equivalent: at exactly 0 the term itself is 0 or the direction has no measure.",
    ),
    (
        "microfacets.x__albedo",
        only(r"cos_h \+ np", "cos_h - np"),
        "Equivalent: the azimuths are symmetric about 90 degrees.",
    ),
    (
        "microfacets.x_kelemen__",
        only(r"1e-12 \* NN", "1e-12 / NN"),
        "The floor for half vectors in the surface: any small number does, the value there is 0 or not of use.",
    ),
    ("diffusion", "XX", "The message only."),
    (
        "diffusion.x__positive_weights",
        r"rcond=None\)\[0\] => .*aim, \)\[0\]|_FIRM / np\.ones",
        "Equivalent: numpy's own default, and a product with 1.",
    ),
    ("diffusion", only(", atol=1e-6", ", "), "How much rounding the sum of the weights may have."),
    (
        "diffusion.x__nearest",
        only(r", _RADII\)", r", \)"),
        "How many radii the fit is taken at: 50 instead of 300 give the same fit.",
    ),
    ("diffusion.x__nearest", r"greatest / _LAST", "Equivalent in effect: other candidates over a like range."),
    ("diffusion.x__nearest", r"error <= best", "Equivalent: a tie between two fits."),
    (
        "diffusion.x__nearest",
        r"^for last in .* => for last in ",
        "Equivalent: for one Gaussian the last width is not used; for more it is one more or fewer candidate.",
    ),
    ("diffusion.x_widened", r"orders //?= factorial", "Equivalent: the quotient is a whole number."),
    (
        "diffusion.x__positive_weights",
        only("w.min\\(\\) >= 0", "w.min\\(\\) > 0"),
        "Equivalent: the weights are not negative here, and 0 weighs nothing.",
    ),
    (
        "",
        r"^(.*reshape\([^()]*)-1\b([^()]*\).*) => \1-2\2$",
        "Equivalent: numpy takes any negative length for the one that follows from the others.",
    ),
)
