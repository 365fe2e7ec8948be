"""What is compiled ahead is what a frame launches."""

import warp as wp

import warp_contact as wc


def test_what_a_frame_launches_is_loaded_before(device, monkeypatch):
    ahead, used = set(), set()
    load, launch = wp.force_load, wp.launch

    def loading(where, modules):
        assert where == device
        ahead.update(module.name for module in modules)
        load(where, modules)

    def launching(kernel, *args, **options):
        used.add(kernel.module.name)
        return launch(kernel, *args, **options)

    monkeypatch.setattr(wp, "force_load", loading)
    monkeypatch.setattr(wp, "launch", launching)
    scene = wc.Scene()
    for z, material in ((0.05, wc.Corotated), (0.151, wc.NeoHookean)):
        scene.add_body(wc.box(0.1, 1), material(2e4, 0.3, 1000.0), (0.0, 0.0, z))
    wc.Simulation(scene, device=str(device)).step_frame()
    assert used == ahead
