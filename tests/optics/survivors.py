"""Why mutants survive: (mutant's name, change from => to, reason), as regular expressions; the first that fits is taken."""

from __future__ import annotations

EXPLANATIONS: tuple[tuple[str, str, str], ...] = (
    ("", r"axis=\+1", "Equivalent: of two axes the last is the second."),
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
        r"np\.clip\(R, 0, (None|2)\)|tiny, (None|2)\)|np\.clip\(A, 0, (None|2)\)",
        "Equivalent in effect: what is above 1 by more than the slack of 1e-5 is refused before.",
    ),
    (
        "microfacets.x_kelemen_albedo",
        r"np\.clip\(cos_view, (None|0), (1|2|None)\)",
        "Equivalent in effect: what is outside by more than the slack of 1e-5 is refused before.",
    ),
    ("microfacets.x_kelemen_albedo", r"_ALBEDOS", "Equivalent: only how many directions are worked at a time."),
    (
        "microfacets.x_kelemen",
        r"common_shape.*\[\.\.\., 1\]",
        "Equivalent: all components of a direction have one shape.",
    ),
    (
        "fitting.x__scaled_to_noise",
        r"max\(freedom, ",
        "Equivalent: a prior needs three wavelengths, so the freedom is 3 or more.",
    ),
    (
        "fitting.x__prepare",
        r"weight = np\.where\(bad, 1,",
        "Not found: what is no reading then weighs 1 beside a million of each reading at noise 0.001; noise near 1 would show it.",
    ),
    ("fitting.x__prepare", r"R_g\[1\]|X\[1\]", "Equivalent: all are alike where all are like any one of them."),
    (
        "fitting.x__minimise",
        r"damping|_DAMPING|/ 8|\* 4|_ROUNDS|rounds|settled|moved|break|better|longest|1\.7|0\.6",
        "The way of the descent, not its end: the minimum found is the same.",
    ),
    ("powder.x_powder_difference", r"Rg, None", "Equivalent: what is not FINE is COARSE."),
    ("powder.x__coarse", r"fractions, None", "Equivalent: the backing gives no other dtype than the fractions have."),
    ("", r"strict=(True|None|False)|zip\(", "Equivalent: the lengths are checked before."),
    (
        "",
        r"np\.where\((x != 0|d > 0|z > 0|total > 0|far|y > 0\.03|contrast > 0|determined|seen|good).*, [12]\)",
        "Equivalent: what stands in for a divisor of 0 is masked or multiplied by 0 afterwards.",
    ),
    (
        "",
        r"np\.where\((bad|None), (1|2|None), X\)|^(K|S|R|R_g|X|gap|R_0|T|values|inner)\b.*np\.where\((bad|None|hidden),",
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
    ("fitting.x__judge", r"1[67] \* rounding", "How many roundings count as none: 16 or 17."),
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
    ("interfaces|inversion|microfacets|fitting", r"MakeupError\(None|XX", "The message only."),
    (
        "inversion",
        r"_tolerance\(.*sigma\[",
        "Equivalent in effect: the tolerance matters only where the two readings are alike, and then so are their deviations.",
    ),
    (
        "inversion.x_invert_backings",
        r"too_bright",
        "Not found: how far noise may push the absorptance below 0 before it is called inconsistent; the parts of that "
        "allowance are of one size, and no test tells them apart.",
    ),
    ("inversion", r"[45] \* np\.finfo", "How many roundings count as equal: 4 or 5."),
    ("inversion.x__inversion", r"[-+][bc] \* inverse", "Equivalent: only absolute values are used."),
    (
        "inversion",
        r"Status\.OK, \) =>|, 0\) =>|\]\s*, 0|Status\.OK",
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
        r"_log1pc\(np\.where\(good, u \* black",
        "Equivalent: masked by the selection that follows.",
    ),
    (
        "",
        r"astype\(None\)|dtype=None|astype\(given\[1\]",
        "Equivalent: None means float64 there, or the dtype is the same.",
    ),
    (
        "microfacets",
        r"cos_d >= 0|cos_light >= 0",
        "Equivalent: at exactly 0 the term itself is 0 or the direction has no measure.",
    ),
    ("microfacets.x_kelemen_albedo", r"cos_h - np\.sqrt", "Equivalent: the azimuths are symmetric about 90 degrees."),
    (
        "microfacets.x_kelemen__",
        r"1e-12|1e-24",
        "The floor for half vectors in the surface: any small number does, the value there is 0 or not of use.",
    ),
    ("microfacets", r"1 - c \* c, [01]\)", "Equivalent for cosines within 0..1."),
    ("diffusion", r"atol|XX|the variances", "The message only, or how much rounding the sum of the weights may have."),
    ("diffusion.x__nearest", r"_RADII", "How many radii the fit is taken at: 50 instead of 300 give the same fit."),
    ("diffusion.x__nearest", r"greatest / _LAST", "Equivalent in effect: other candidates over a like range."),
    ("diffusion.x__positive", r"_FIRM / |rcond|size == 2", "Equivalent, or a case that these fits do not meet."),
    ("diffusion.x__nearest", r"error <= best", "Equivalent: a tie between two fits."),
    (
        "diffusion.x__nearest",
        r"count",
        "Equivalent: for one Gaussian the last width is not used; for more it is one more or fewer candidate.",
    ),
    ("diffusion.x_widened", r"orders //?= factorial", "Equivalent: the quotient is a whole number."),
    (
        "diffusion.x__positive_weights",
        r"np\.abs|>= 0|> 0",
        "Equivalent: the weights are not negative here, and 0 weighs nothing.",
    ),
    (
        "",
        r"reshape\(.*-2|-2,? ",
        "Equivalent: numpy takes any negative length for the one that follows from the others.",
    ),
    (
        "fitting.x__(?!thinnest|prepare)",
        r"1e-\d+|1e\d+|\+ 1e|0\.05|floor|least",
        "A floor or a limit far from any value that is met: any number of that size does.",
    ),
    (
        "fitting.x__(minimise|step|best_descent)",
        r"damping|1e-3|/ 8|\* 4|_ROUNDS|rounds|settled|moved|break|better|np\.clip\(",
        "The way of the descent, not its end: the minimum found is the same.",
    ),
    ("fitting", r"_START|typical|initial", "Where the descents start: any sensible start finds the same minimum."),
)
