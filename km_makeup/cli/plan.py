"""`plan`: the effects that a head's pictures call for; and the options of other commands that plans go by."""

from __future__ import annotations

import argparse
import json

from ..errors import MakeupError
from ..jobs import EffectsJob, PlanJob
from .parts import OK, add_head_arguments, between, blender_aside, head_of, more_products, size_of


def add_effects_arguments(sub: argparse.ArgumentParser) -> None:
    sub.add_argument("--tolerance", type=float, metavar="DE",
                     help="colour difference (ΔE2000) that all effects left out may make together (default: the file's, 0.5)")  # fmt: skip
    sub.add_argument("--everything", action="store_true", help="build every effect, without asking the plan")


def add_diffusion_argument(sub: argparse.ArgumentParser) -> None:
    sub.add_argument(
        "--diffuse", nargs="?", type=int, const=6, metavar="GAUSSIANS",
        help="EEVEE: the compositor diffuses the skin's light, by at most 1 to 6 Gaussians (default: 6), instead of EEVEE",
    )  # fmt: skip


def add_arguments(sub: argparse.ArgumentParser) -> None:
    add_head_arguments(sub)
    add_effects_arguments(sub)
    sub.add_argument(
        "--budget", type=float, metavar="MS", help="milliseconds a frame: raise the tolerance until it is kept"
    )
    add_diffusion_argument(sub)
    sub.add_argument("--engine", choices=["eevee", "cycles"], help="render engine (default: the file's)")
    sub.add_argument("--colour", choices=["live", "baked", "finished"], help="as for render (default: the file's)")
    sub.add_argument("--size", help="width x height in pixels (default: the file's)")
    sub.add_argument("--samples", type=int, help="samples per pixel (default: the file's)")
    sub.add_argument(
        "--view", default="", help="views as for render; several with commas (default: the file's cameras)"
    )


def effects_of(options: argparse.Namespace, budget: float | None = None) -> EffectsJob:
    for value, name in ((options.tolerance, "--tolerance"), (budget, "--budget")):
        if value is not None and not 0 <= value < 1e6:
            raise MakeupError(f"{name} is {value}; it must be 0 or more.")
    asked = getattr(options, "diffuse", None)
    gaussians = between(asked, "--diffuse", 1, 6) if asked is not None else 0
    return EffectsJob(options.tolerance, options.everything, budget, gaussians)


def run(options: argparse.Namespace) -> int:
    from ..effects import lines, summary

    more_products(options.products)
    job = PlanJob(
        head=head_of(options),
        effects=effects_of(options, options.budget),
        engine=options.engine,
        colour=options.colour,
        size=size_of(options.size) if options.size else None,
        samples=between(options.samples, "--samples", 1, 2**24) if options.samples is not None else None,
        views=tuple(view.strip() for view in options.view.split(",") if view.strip()),
    )
    with blender_aside():
        from ..blender.calibration import whose_costs
        from ..blender.commands import run_plan

        plan, costs = run_plan(job), whose_costs()
    if options.json:
        effects = [
            {
                "key": one.key, "name": one.name, "on": one.on, "reduced": one.reduced, "reason": one.reason,
                "error": one.error, "cost": vars(one.cost), "said": one.said.value if one.said else None,
            }
            for one in plan.effects
        ]  # fmt: skip
        total = {
            "tolerance": plan.tolerance,
            "left_out": plan.left_out,
            "cost": vars(plan.cost),
            "summary": summary(plan),
            "costs": costs,
        }
        print(json.dumps({**total, "effects": effects}))
    else:
        print("\n".join(lines(plan)))
        print(f"what is on costs {plan.cost}\n{costs}")
    return OK
