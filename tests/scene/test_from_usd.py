"""scene/from_usd.py and the files that read for it: what a stage says becomes a scene."""

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdShade

import warp_contact as wc
from warp_contact.scene.scene import rotation_matrix

MESH = wc.box((0.1, 0.12, 0.08), 2)
TURN = (0.1, 0.2, 0.3, 0.9)


def foreign(path) -> Usd.Stage:
    """A stage of others: centimetres, grams, y up, names of vendors, a die scaled by 2."""
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 0.001)
    UsdGeom.SetStageUpAxis(stage, "Y")
    UsdPhysics.Scene.Define(stage, "/scene").CreateGravityMagnitudeAttr(162.0)
    die = UsdGeom.Xform.Define(stage, "/World/die")
    die.AddTranslateOp().Set((0.0, 100.0, 0.0))
    die.AddRotateZOp().Set(90.0)
    die.AddScaleOp().Set((2.0, 2.0, 2.0))
    moves = UsdPhysics.RigidBodyAPI.Apply(die.GetPrim())
    moves.CreateVelocityAttr((0.0, -300.0, 0.0))
    moves.CreateAngularVelocityAttr((0.0, 180.0, 0.0))
    UsdPhysics.MassAPI.Apply(die.GetPrim()).CreateMassAttr(5000.0)
    tets(stage, "/World/die/tets").AddAppliedSchema("PhysicsCollisionAPI")
    soft = tets(stage, "/World/soft")
    UsdGeom.Xformable(soft).AddTranslateOp().Set((50.0, 0.0, 0.0))
    soft.AddAppliedSchema("OmniPhysicsDeformableBodyAPI")
    jelly = {"youngsModulus": 1e4, "poissonsRatio": 0.3, "density": 1.2, "dynamicFriction": 0.6}
    bind(stage, soft, jelly, "omniphysics")
    stage.SetDefaultPrim(stage.GetPrimAtPath("/World"))
    return stage


def tets(stage, path: str) -> Usd.Prim:
    """A TetMesh, ten centimetres large."""
    mesh = UsdGeom.TetMesh.Define(stage, path)
    mesh.CreatePointsAttr((100.0 * MESH.vertices).tolist())
    mesh.CreateTetVertexIndicesAttr(MESH.tets.tolist())
    return mesh.GetPrim()


def bind(stage, prim, values: dict, space: str) -> None:
    """Give a prim a material of its own."""
    material = UsdShade.Material.Define(stage, f"{prim.GetPath()}_material")
    for name, value in values.items():
        kind = Sdf.ValueTypeNames.Float
        material.GetPrim().CreateAttribute(f"{space}:{name}", kind).Set(value)
    UsdShade.MaterialBindingAPI.Apply(prim).Bind(material, materialPurpose="physics")


def read(stage, **options) -> wc.Scene:
    """What is read of a stage, whatever it warns of."""
    stage.Save()
    with pytest.warns(UserWarning, match="not read or assumed"):
        return wc.Scene.from_usd(stage.GetRootLayer().realPath, **options)


def test_units_axes_and_names_of_others_are_understood(tmp_path):
    scene = read(foreign(tmp_path / "a.usda"))
    assert scene.gravity == (0.0, 0.0, -1.62)
    die, soft = scene.bodies
    assert (die.label, soft.label, soft.friction) == ("die", "soft", 0.6)
    # Grams and centimetres: 1.2 g/cm^3, 1e4 g/(cm s^2) are 1200 kg/m^3, 1000 Pa; float32.
    assert soft.material.youngs_modulus == pytest.approx(1e3, rel=1e-6)
    assert soft.material.density == pytest.approx(1200.0, rel=1e-6)
    assert die.material.mass or die.material.density * die.mesh.volume == pytest.approx(5.0)
    upright = MESH.vertices @ np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    np.testing.assert_allclose(soft.x, upright + [0.5, 0.0, 0.0], atol=1e-7)
    # Turned by 90 degrees about the stage's z, which is -y here, and twice as large.
    turned = 2.0 * upright @ rotation_matrix((0.0, -np.sqrt(0.5), 0.0, np.sqrt(0.5))).T
    np.testing.assert_allclose(die.x, turned + [0.0, 0.0, 1.0], atol=1e-7)
    spin = np.cross([0.0, 0.0, np.pi], die.x - [0.0, 0.0, 1.0])
    np.testing.assert_allclose(die.v, spin + [0.0, 0.0, -3.0], atol=1e-6)
    assert scene.not_read == ["no friction of /World/die: that of the scene"]


def test_what_is_not_understood_is_listed(tmp_path):
    stage = foreign(tmp_path / "a.usda")
    soft = stage.GetPrimAtPath("/World/soft")
    soft.AddAppliedSchema("PhysxBaseDeformableBodyAPI")
    name = "physxDeformableBody:solverPositionIterationCount"
    soft.CreateAttribute(name, Sdf.ValueTypeNames.Int).Set(16)
    UsdPhysics.DistanceJoint.Define(stage, "/joint").CreateBody0Rel().SetTargets(["/World/die"])
    UsdPhysics.CollisionAPI.Apply(UsdGeom.Cube.Define(stage, "/wall").GetPrim())
    UsdPhysics.RigidBodyAPI.Apply(UsdGeom.Sphere.Define(stage, "/marble").GetPrim())
    UsdPhysics.Scene.Define(stage, "/second")
    UsdGeom.Cube.Define(stage, "/seen")
    said = read(stage).not_read
    for line in (
        "PhysxBaseDeformableBodyAPI: /World/soft",
        f"{name} = 16: /World/soft",
        "PhysicsDistanceJoint: /joint",
        "a Cube that collides, without tets: /wall",
        "a body without a TetMesh: /marble",
        "PhysicsScene /second: /scene counts",
        "Cube, only seen: /seen",
    ):
        assert line in said
    assert len(said) == 9  # with the friction of the die, and the marble, which is seen too


def test_attachments_to_what_stands_still_hold_vertices(tmp_path):
    stage = foreign(tmp_path / "a.usda")
    post = UsdGeom.Xform.Define(stage, "/post").GetPath()
    kinds = Sdf.ValueTypeNames
    for path, kind, space, ids, to in (
        ("/pin", "PhysicsAttachment", "physics", "indices0", None),
        ("/nail", "OmniPhysicsVtxXformAttachment", "omniphysics", "vtxIndicesSrc0", post),
        ("/rope", "OmniPhysicsVtxXformAttachment", "omniphysics", "vtxIndicesSrc0", "/World/die"),
    ):
        prim = stage.DefinePrim(path, kind)
        prim.CreateRelationship(f"{space}:src0").SetTargets(["/World/soft"])
        if to:
            prim.CreateRelationship(f"{space}:src1").SetTargets([to])
        prim.CreateAttribute(f"{space}:{ids}", kinds.IntArray).Set([len(path), 1])
    scene = read(stage)
    assert np.flatnonzero(scene.bodies[1].fixed).tolist() == [1, 4, 5]
    reason = "which does not say where its vertices are held"
    assert f"OmniPhysicsVtxXformAttachment: /rope, {reason}" in scene.not_read


def jointed(stage) -> Usd.Stage:
    """With an arm at the die, and joints that hold it or cannot be read."""
    arm = UsdGeom.Xform.Define(stage, "/World/arm")
    arm.AddTranslateOp().Set((0.0, 100.0, 40.0))
    UsdPhysics.RigidBodyAPI.Apply(arm.GetPrim())
    tets(stage, "/World/arm/tets").AddAppliedSchema("PhysicsCollisionAPI")
    joints = [
        UsdPhysics.RevoluteJoint.Define(stage, "/elbow"),
        UsdPhysics.FixedJoint.Define(stage, "/apart"),
        UsdPhysics.PrismaticJoint.Define(stage, "/idle"),
        UsdPhysics.SphericalJoint.Define(stage, "/nail"),
        UsdPhysics.FixedJoint.Define(stage, "/soft"),
    ]
    for joint, other in zip(joints, ("die", "die", "die", "arm", "soft"), strict=True):
        joint.CreateBody0Rel().SetTargets([f"/World/{other}"])
        joint.CreateBody1Rel().SetTargets(["/World/arm/tets"] if other == "die" else [])
    elbow, apart, idle, nail, _ = joints
    elbow.CreateAxisAttr("Z")
    # The die is twice as large; 20 cm from it, and from the arm, is the elbow.
    elbow.CreateLocalPos0Attr((0.0, 0.0, 10.0))
    elbow.CreateLocalPos1Attr((0.0, 0.0, -20.0))
    elbow.CreateBreakForceAttr(5e5)
    elbow.CreateLowerLimitAttr(-90.0)
    apart.CreateLocalPos1Attr((0.0, 0.0, -20.0))
    idle.CreateJointEnabledAttr(False)
    nail.CreateLocalPos1Attr((0.0, 100.0, 40.0))
    return stage


def test_joints_of_others_hold_bodies_where_they_are(tmp_path):
    stage = jointed(foreign(tmp_path / "a.usda"))
    scene = read(stage)
    hinge, pin = scene.attachments
    assert (hinge.label, hinge.kind) == ("elbow", "hinge")
    assert (hinge.a.label, hinge.b.label) == ("arm", "die")
    assert (pin.label, pin.kind, pin.a.label, pin.b) == ("nail", "ball", "arm", None)
    # Centimetres with y up are metres with z up: its axis is -y here. 1 g cm/s^2 are 1e-5 N.
    assert hinge.breaking_force == pytest.approx(5.0)
    np.testing.assert_allclose(hinge.points.mean(axis=0), [0.0, -0.2, 1.0], atol=1e-7)
    np.testing.assert_allclose(np.diff(hinge.points, axis=0)[0], [0.0, -0.12, 0.0], atol=1e-6)
    np.testing.assert_allclose(pin.points, [[0.0, -0.4, 1.0]], atol=1e-7)
    for line in (
        "physics:lowerLimit = -90.0: /elbow",
        "PhysicsFixedJoint: /apart, whose two frames are not in the same place",
        "PhysicsPrismaticJoint: /idle, which is not enabled",
        "PhysicsFixedJoint: /soft, which names a body that deforms: attachments hold such",
    ):
        assert line in scene.not_read
    assert not any("/nail" in line for line in scene.not_read)


def test_attachments_of_others_to_rigid_bodies_are_welds(tmp_path):
    stage, ids = foreign(tmp_path / "a.usda"), [0, 1, 2, 5]
    x = 100.0 * MESH.vertices[ids] + (50.0, 0.0, 0.0)
    at_die = x + (0.0, -100.0, 0.0)
    at_die = at_die @ np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]) / 2.0
    for path, places in ("/glue", at_die), ("/far", at_die + 1.0):
        prim, kinds = stage.DefinePrim(path, "PhysicsAttachment"), Sdf.ValueTypeNames
        prim.CreateRelationship("physics:src0").SetTargets(["/World/soft"])
        prim.CreateRelationship("physics:src1").SetTargets(["/World/die"])
        prim.CreateAttribute("physics:indices0", kinds.IntArray).Set(ids)
        prim.CreateAttribute("physics:type1", kinds.Token).Set("xform")
        prim.CreateAttribute("physics:coords1", kinds.Vector3fArray).Set(places.tolist())
        prim.CreateAttribute("physics:stiffness", kinds.Float).Set(4e3)
    scene = read(stage)
    (glue,) = scene.attachments
    assert (glue.kind, glue.a.label, glue.b.label) == ("weld", "soft", "die")
    assert glue.stiffness == pytest.approx(16.0)  # of four points, each 4e3 g/s^2
    np.testing.assert_array_equal(glue.verts[:, 0], ids)
    there = -np.einsum("nk,nkc->nc", glue.weights[:, 4:], glue.b.x[glue.verts[:, 4:]])
    np.testing.assert_allclose(there, glue.a.x[ids], atol=1e-6)  # float32 of a metre
    line = "PhysicsAttachment: /far, whose vertices are not where they are held"
    assert line in scene.not_read


def test_kinematic_bodies_colliding_tets_and_planes_are_obstacles(tmp_path):
    stage = foreign(tmp_path / "a.usda")
    UsdPhysics.RigidBodyAPI(stage.GetPrimAtPath("/World/die")).CreateKinematicEnabledAttr(True)
    wall = tets(stage, "/wall")
    UsdGeom.Xformable(wall).AddTranslateOp().Set((-50.0, 0.0, 0.0))
    wall.AddAppliedSchema("PhysicsCollisionAPI")
    floor = UsdGeom.Plane.Define(stage, "/floor")
    floor.CreateAxisAttr("Y")
    floor.AddTranslateOp().Set((7.0, -30.0, 0.0))
    UsdPhysics.CollisionAPI.Apply(floor.GetPrim())
    scene = read(stage)
    assert [(b.label, bool(b.fixed.all())) for b in scene.bodies] == [
        ("die", True),
        ("soft", False),
        ("wall", True),
    ]
    assert scene.bodies[2].material.kernels is None
    ((n, h),) = scene.planes
    np.testing.assert_allclose([*n, h], [0.0, 0.0, 1.0, -0.3], atol=1e-7)


def test_a_body_starts_deformed_where_its_rest_shape_is_another(tmp_path):
    stage = foreign(tmp_path / "a.usda")
    rest = stage.GetPrimAtPath("/World/soft").CreateAttribute(
        "omniphysics:restShapePoints", Sdf.ValueTypeNames.Point3fArray
    )
    rest.Set((98.0 * MESH.vertices).tolist())
    soft = read(stage).bodies[1]
    # Float32 of 10 cm.
    np.testing.assert_allclose(np.ptp(soft.x, axis=0), 0.98 * np.ptp(soft.start, axis=0), rtol=1e-6)
    scene = wc.Scene((0.0, 0.0, 0.0))
    scene.bodies.append(soft)
    object.__setattr__(soft, "index", 0)
    sim = wc.Simulation(scene)
    np.testing.assert_allclose(sim.positions(), soft.start, atol=1e-7)
    squeezed = sim.measure().elastic
    # Strain 1/49 in all directions: 9 K e^2 / 2 of a volume, K = E / (3 - 6 nu); 6 % by its size.
    wanted = 4.5 * 1e3 / (3.0 - 1.8) * (1.0 / 49.0) ** 2 * soft.mesh.volume
    assert squeezed == pytest.approx(wanted, rel=0.06)


def test_a_stage_that_makes_no_scene_is_refused_with_what_to_do(tmp_path):
    stage = foreign(tmp_path / "a.usda")
    tets(stage, "/bare")
    stage.Save()
    with pytest.raises(ValueError, match=r"/bare: has no youngsModulus: give material=wc\.Neo"):
        wc.Scene.from_usd(tmp_path / "a.usda")
    scene = read(stage, material=wc.NeoHookean(1e5, 0.3, 1000.0))
    assert scene.bodies[-1].material.youngs_modulus == 1e5
    text = (tmp_path / "a.usda").read_text()
    (tmp_path / "b.usda").write_text(text[: len(text) // 2])
    (tmp_path / "c.usda").write_text("#usda 1.0\n")
    (tmp_path / "d.stl").write_text("solid")
    for name, words in (
        ("b.usda", "is not a readable USD file"),
        ("c.usda", "holds no TetMesh: bodies are of tets"),
        ("d.stl", "give a USD file"),
    ):
        with pytest.raises(ValueError, match=words):
            wc.Scene.from_usd(tmp_path / name)
    with pytest.raises(FileNotFoundError, match=r"holds 3 \.usda files"):
        wc.Scene.from_usd(tmp_path)
    with pytest.raises(ValueError, match="at, which may be 'start' or 'last' too, 'end'"):
        wc.Scene.from_usd(tmp_path / "a.usda", at="end")
    with pytest.raises(ValueError, match="does not say its startTimeCode"):
        wc.Scene.from_usd(tmp_path / "a.usda", at="last")


def test_quaternions_of_moments_are_those_of_usd(tmp_path):
    stage, turn = foreign(tmp_path / "a.usda"), rotation_matrix(TURN)
    mass = UsdPhysics.MassAPI(stage.GetPrimAtPath("/World/die"))
    mass.CreateDiagonalInertiaAttr((3e5, 4e5, 5e5))  # [g cm^2]
    mass.CreatePrincipalAxesAttr(Gf.Quatf(TURN[3], *TURN[:3]))
    found = np.array(read(stage).bodies[0].material.inertia)
    np.testing.assert_allclose(found, turn @ np.diag([0.03, 0.04, 0.05]) @ turn.T, atol=1e-8)


def test_what_a_stage_does_not_say_of_a_mass_is_that_of_the_shape(tmp_path):
    stage = foreign(tmp_path / "a.usda")
    die, soft = (stage.GetPrimAtPath(f"/World/{name}") for name in ("die", "soft"))
    UsdPhysics.MassAPI(die).CreateCenterOfMassAttr((1.0, 0.0, 0.0))  # 2 cm, as it is scaled by 2
    soft.CreateAttribute("omniphysics:mass", Sdf.ValueTypeNames.Float).Set(3000.0)
    given, jelly = (body.material for body in read(stage).bodies)
    assert jelly.density * MESH.volume == pytest.approx(3.0, rel=1e-6)
    assert (given.mass, given.centre) == (5.0, pytest.approx((0.02, 0.0, 0.0), abs=1e-9))
    full = wc.Rigid(5.0 / (8.0 * MESH.volume)).solid(2.0 * MESH.vertices, MESH.tets)
    wanted = full.inertia + 5.0 * 0.02**2 * np.diag([0.0, 1.0, 1.0])
    np.testing.assert_allclose(given.inertia, wanted, atol=1e-8)  # float32


def test_names_that_are_taken_are_numbered(tmp_path):
    stage = foreign(tmp_path / "a.usda")
    for path in "/other/soft", "/plane0":
        tets(stage, path).AddAppliedSchema("PhysicsDeformableBodyAPI")
        UsdGeom.Xformable(stage.GetPrimAtPath(path)).AddTranslateOp().Set((0.0, len(path), 900.0))
    scene = read(stage, material=wc.NeoHookean(1e5, 0.3, 1000.0))
    assert [body.label for body in scene.bodies] == ["die", "soft", "soft_1", "plane0_1"]
