"""How much of the sky the skin in a picture does not see."""

from __future__ import annotations

import bpy  # before bmesh, which is part of it

# isort: split
import bmesh
import pytest

from km_makeup.blender.occlusion import occlusion_of


def made(shape) -> bpy.types.Object:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    mesh, form = bpy.data.meshes.new("Shape"), bmesh.new()
    shape(form)
    form.to_mesh(mesh)
    form.free()
    obj = bpy.data.objects.new("Shape", mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def camera(place, turned=(0, 0, 0)) -> None:
    found = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    found.location, found.rotation_euler = place, turned
    bpy.context.scene.collection.objects.link(found)
    bpy.context.scene.camera = found
    bpy.context.view_layer.update()


def ball(form, inward: bool = False) -> None:
    bmesh.ops.create_uvsphere(form, u_segments=48, v_segments=24, radius=1.0)
    if inward:
        bmesh.ops.reverse_faces(form, faces=form.faces)


def test_a_ball_blocks_nothing_of_its_own_sky() -> None:
    obj = made(ball)
    camera((0, 0, 5))
    assert occlusion_of(obj, bpy.context.scene) == 0


def test_the_inside_of_a_hollow_ball_sees_no_sky() -> None:
    obj = made(lambda form: ball(form, True))
    camera((0, 0, 0))
    assert occlusion_of(obj, bpy.context.scene) == 1


def test_half_a_hollow_ball_seen_from_afar_blocks_half() -> None:
    """A patch inside a bowl of half a ball receives half of its own bowl's light: form factor of a spherical cap, area over 4 pi r^2."""

    def bowl(form) -> None:
        ball(form, True)
        bmesh.ops.delete(form, geom=[v for v in form.verts if v.co.z > 1e-6], context="VERTS")

    obj = made(bowl)
    camera((0, 0, 500))
    assert occlusion_of(obj, bpy.context.scene) == pytest.approx(0.5, abs=0.02)


def test_what_the_camera_does_not_see_does_not_count() -> None:
    def two(form) -> None:
        bmesh.ops.create_cube(form, size=2)
        bmesh.ops.create_grid(form, x_segments=1, y_segments=1, size=0.9)
        for vertex in form.verts[-4:]:
            vertex.co.z = -1.01

    obj = made(two)
    camera((0, 0, 5))
    assert occlusion_of(obj, bpy.context.scene) == 0, "only the top of the cube is seen, and it sees all of the sky"


def test_nothing_to_be_seen_blocks_nothing() -> None:
    assert occlusion_of(made(lambda form: None), bpy.context.scene) == 0
