"""Looks, stacks and cosmetic maps as plain data and arrays; what a stack does to the colour of skin."""

from .coat import Coat, OnSkin, coat, coats_of, interface_of, on_skin
from .look import Layer, Look, PaintedOn, parse_layer
from .transfer import Transfer, fit_transfer, fit_transfers

__all__ = [
    "Coat",
    "Layer",
    "Look",
    "OnSkin",
    "PaintedOn",
    "Transfer",
    "coat",
    "coats_of",
    "fit_transfer",
    "fit_transfers",
    "interface_of",
    "on_skin",
    "parse_layer",
]
