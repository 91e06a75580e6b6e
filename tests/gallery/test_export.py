"""Programs of the gallery and of scenes: read by other libraries, solved, and judged."""

import json
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import clarabel
import highspy
import numpy as np
import pytest
import qpsolvers
import scs
from gallery_answers import true_statuses
from picos.modeling.file_in import import_cbf
from scenes import PAPER_APPROACH, complementary_energy, hexagonal
from scipy import sparse

import convexrough as cr
from convexrough import cli, gallery

#: Tolerance of interior-point solvers; an energy that near fixes loads to its root only.
TOLERANCE = 1e-9
NEAR = 1e-4

each_case = pytest.mark.parametrize("name", gallery.names())


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("gallery") / "pack"
    assert cli.main(["gallery", "--export", str(folder)]) == 0
    return folder


def judged(name: str, about: Any, x: Any, near: float) -> None:
    """As the index says how, and by the certificate, whose statuses are held against the answer."""
    case = gallery.case(name)
    loads = np.zeros(len(case))
    members = about["asperities"]
    loads[members] = np.maximum(about["force_unit"] * np.array(x[: len(members)]), 0.0)
    assert case.check(loads).error < near
    assert true_statuses(case, cr.certify(case.scene, loads, **case.control).status)


def program(pack: Path, name: str, ending: str) -> Any:
    case = json.loads((pack / "index.json").read_text())["cases"][name]
    found = case["programs"].get(f"{name}.{ending}")
    if found is None:
        kind = "bristles" if ending.startswith("bristles") else "cones"
        assert "convex" in case["left_out"].get(kind, "convex"), name
    return found


@pytest.mark.sample(3)
@each_case
@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")  # how qpsolvers calls OSQP
def test_bristle_programs(name: str, pack: Path) -> None:
    about = program(pack, name, "bristles.npz")
    if about is None:
        return
    problem = qpsolvers.Problem.load(pack / f"{name}.bristles.npz")
    assert len(problem.q) == about["variables"]
    assert problem.lb is None
    assert np.array_equal(problem.P, problem.P.T)
    problem.P, problem.G, problem.A = map(sparse.csc_matrix, (problem.P, problem.G, problem.A))
    settings = {"eps_abs": TOLERANCE, "eps_rel": TOLERANCE, "max_iter": 50_000, "polishing": True}
    for solver, given in (("clarabel", {}), ("osqp", settings)):
        found = qpsolvers.solve_problem(problem, solver, **given)
        judged(name, about, found.x, about["load_error_estimate"])


def by_scs(P: Any, A: Any, b: Any, c: Any, equalities: int, sizes: list[int]) -> Any:
    given, cones = {"P": P, "A": A, "b": b, "c": c}, {"z": equalities, "q": sizes}
    limits = {"eps_abs": TOLERANCE, "eps_rel": TOLERANCE, "max_iters": 50_000}
    return scs.SCS(given, cones, verbose=False, **limits).solve()


@pytest.mark.sample(3)
@each_case
def test_cone_programs_by_another_solver(name: str, pack: Path) -> None:
    """By Clarabel's own reader, and by SCS, which takes the numbers of the same file."""
    about = program(pack, name, "cones.json")
    if about is None:
        return
    path = pack / f"{name}.cones.json"
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = TOLERANCE
    first = clarabel.load_from_file(str(path), settings).solve()
    assert abs(first.obj_val - about["objective"]) < 1e-7 * max(abs(about["objective"]), 1e-3)
    data = json.loads(path.read_text())
    P, A = (
        sparse.csc_array((it["nzval"], it["rowval"], it["colptr"]), shape=(it["m"], it["n"]))
        for it in (data["P"], data["A"])
    )
    zero, *orders = data["cones"]
    sizes = [cone["SecondOrderConeT"] for cone in orders]
    second = by_scs(P, A, np.array(data["b"]), np.array(data["q"]), zero["ZeroConeT"], sizes)
    for x in (first.x, second["x"]):
        judged(name, about, x, NEAR)


@pytest.mark.sample(2)
@pytest.mark.filterwarnings("ignore::DeprecationWarning:picos")  # of PICOS' reader, by itself
@pytest.mark.parametrize("name", ["one", "two-equal", "load-1e-15", "convexity-bound-1-above",
                                  "convexity-solution-21-25-above", "ring-of-six",
                                  "grazing-load-1e-9", "shear-1e-12-of-all"])  # fmt: skip
def test_cbf(name: str, pack: Path) -> None:
    """Through a reader of CBF that shares nothing with our writer."""
    about = program(pack, name, "cbf")
    problem, (variables,), *_ = import_cbf(str(pack / f"{name}.cbf"))
    assert len(variables) == about["variables"]  # the last one is the quadratic term
    solvers = [name for name in ("cvxopt", "ecos") if find_spec(name)]  # ECOS has no wheel for 3.13
    for solver in solvers:
        settings = {"rel_bnb_opt_tol": None, "abs_prim_fsb_tol": 1e-8, "verbosity": 0}
        problem.solve(solver=solver, **settings)
        judged(name, about, np.ravel(variables.value), NEAR)
        least = about["objective"]
        assert abs(problem.value - least) < 1e-6 * max(abs(least), 1e-3)


def test_the_command(command: Any, tmp_path: Path) -> None:
    output = command("gallery", "few")
    assert output.status == 0
    assert output.out.count("\n") == 4
    assert "two equal contacts" in output.out
    assert command("gallery", "grasing").refuses("grazing")
    assert command("gallery", "few", "--export", "pack").status == 0
    assert command("gallery", "few", "--export", "pack").refuses("not empty")
    before = {path.name: path.read_bytes() for path in (tmp_path / "pack").iterdir()}
    assert command("gallery", "few", "--export", "pack", "--force").status == 0
    assert before == {path.name: path.read_bytes() for path in (tmp_path / "pack").iterdir()}
    said = command("gallery", "few", "--json")
    assert list(json.loads(said.out)["cases"]) == ["one", "one-under-load", "two-equal"]


#: The source paper's, its inner 19 asperities.
SCENE = hexagonal(within=0.0051)
CONTACT = cr.press(SCENE, approach=PAPER_APPROACH)
FEW = 8  # bristles: the method of HiGHS is one of active sets, and takes its time with more


def matrix(data: Any, name: str, shape: tuple[int, int]) -> Any:
    parts = [data[f"{name}_{part}"] for part in ("data", "indices", "indptr")]
    return sparse.csc_array(tuple(parts), shape=shape)


def of_arrays(path: Path) -> tuple[Any, Any, float]:
    data = np.load(path)
    n, m, equal = len(data["q"]), len(data["b"]), int(data["equalities"])
    P, A = matrix(data, "P", (n, n)), matrix(data, "A", (m, n))
    assert abs(P - P.T).max() == 0  # SCS itself reads the upper triangle only
    found = by_scs(P, A, data["b"], data["q"], equal, [3] * ((m - equal) // 3))
    return found["x"], found["y"], found["info"]["pobj"]


def by_highs(path: Path) -> tuple[Any, Any, float]:
    highs = highspy.Highs()
    highs.setOptionValue("output_flag", False)
    assert highs.readModel(str(path)) == highspy.HighsStatus.kOk
    highs.run()
    solution = highs.getSolution()
    return solution.col_value, solution.row_dual, highs.getObjectiveValue()


@pytest.mark.parametrize("control", ["approach", "load"])
@pytest.mark.parametrize("name", ["cones.npz", "dual.npz", "bristles.mps"])
def test_files_are_solved_by_others(name: str, control: str, tmp_path: Path) -> None:
    """Other forms and endings are those of the gallery, which its tests read."""
    form: Any = Path(name).stem
    made = cr.program(SCENE, form, **{control: getattr(CONTACT, control)}, bristles=FEW)
    made.save(tmp_path / name)
    x, z, objective = (by_highs if form == "bristles" else of_arrays)(tmp_path / name)
    loads = made.loads(z if form == "dual" else x)
    near, exact = 1e-4 + made.load_error_estimate, complementary_energy(CONTACT)
    if control == "approach":  # Phi: docs/theory/convexity.md, (1)
        exact -= PAPER_APPROACH * CONTACT.load
    assert np.abs(loads - CONTACT.loads).max() < near * CONTACT.loads.max()
    if form == "bristles":  # another energy than that of the contact: its own
        assert objective == pytest.approx(made.objective, rel=1e-6)
    else:
        assert made.energy(made.objective) == pytest.approx(exact, rel=1e-12)
    assert made.energy(objective) == pytest.approx(exact, rel=1e-6 + made.load_error_estimate)


def test_the_command_for_a_scene(command: Any, tmp_path: Path) -> None:
    command("new", "scene.toml")
    ran = command("export", "scene.toml", "--bristles", "4")
    assert (ran.status, ran.err) == (0, "")
    folder = tmp_path / "scene-programs"
    index = json.loads((folder / "index.json").read_text())
    written = {path.name for path in folder.iterdir()}
    assert written == {*index["programs"], "index.json", "files.json"}
    assert len(index["programs"]) == 8
    assert command("export", "scene.toml").refuses("not empty")
    one = command("export", "scene.toml", "--format", "mps", "--out", "one", "--json")
    assert list(json.loads(one.out)["programs"]) == ["scene.bristles.mps"]
    assert command("export", "scene.toml", "--format", "mpz").refuses("mpz")
