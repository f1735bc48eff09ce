"""The pages that `binpose detect --view` and `binpose model --view` write, opened in a browser and clicked through."""

import json
import math
import re
import shutil
import sys
import tempfile
import unittest
from pathlib import Path

import browser
from binpose_process import Server
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.actions.action_builder import ActionBuilder
from selenium.webdriver.common.actions.interaction import POINTER_TOUCH
from selenium.webdriver.common.actions.pointer_input import PointerInput
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

DATA = Path(__file__).resolve().parents[1] / "data"
PART = DATA / "parts/bearing_support.stl"
SCENE = DATA / "scenes/bearing_support_01"
NOT_BUILT = 77  # for ctest: skipped


def write_box(path, x, y, z):
    """STL of a box of three lengths, which four turns bring onto itself."""
    corners = [[(x, y, z)[axis] * ((corner >> axis) & 1) for axis in range(3)] for corner in range(8)]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = [t for a, b, c, d in faces for t in [(a, b, c), (a, c, d)]]
    path.write_text("solid box\n" + "".join(
        "facet normal 0 0 0\nouter loop\n" + "".join("vertex {} {} {}\n".format(*corners[i]) for i in triangle) +
        "endloop\nendfacet\n" for triangle in triangles) + "endsolid box\n")


def write_scene_four_times_as_dense(folder):
    """The sample scene with each pixel of its depth image as four; returns how many were measured."""
    import numpy as np
    from PIL import Image
    folder.mkdir()
    depth = np.kron(np.asarray(Image.open(SCENE / "depth.png")), np.ones((2, 2), np.uint16)).astype(np.uint16)
    Image.fromarray(depth).save(folder / "depth.png")
    camera = json.loads((SCENE / "camera.json").read_text())
    for name in ["width", "height", "fx", "fy"]:
        camera[name] *= 2
    for name in ["cx", "cy"]:
        camera[name] = 2 * camera[name] + 0.5
    (folder / "camera.json").write_text(json.dumps(camera))
    return int((depth > 0).sum())


def parts_of_a_page(path):
    """The text of a page before, of, and after its data."""
    return re.match(r'(.*<script type="application/json" id="data">)(.*?)(</script>.*)', path.read_text(), re.DOTALL).groups()


def write_changed(page, source, change):
    """Writes a page like `source`, whose data `change` has changed."""
    head, text, tail = parts_of_a_page(source)
    data = json.loads(text)
    change(data)
    page.write_text(head + json.dumps(data).replace("<", "\\u003c") + tail)


class ViewerTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.directory = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.directory.name)
        cls.server = Server(cls.folder / "models")
        cls.server.binpose_json("train", "--id", "part", "--mesh", PART, "--unit", "mm")
        cls.page = cls.folder / "result.html"
        [cls.answer] = cls.server.binpose_json(
            "detect", "--model", "part", "--scene", SCENE, "--unit", "mm", "--view", cls.page, "--mesh", PART,
            "--mesh-unit", "mm", "--truth", SCENE / "gt.json")
        cls.model_page = cls.folder / "model.html"
        [cls.model] = cls.server.binpose_json("model", "part", "--view", cls.model_page)
        cls.driver = browser.start()

    @classmethod
    def tearDownClass(cls):
        cls.driver.quit()
        cls.server.stop()
        cls.directory.cleanup()

    def open(self, page, state="ready"):
        self.driver.get_log("browser")  # empties it
        self.assertEqual(browser.open_page(self.driver, page), state)
        browser.draw(self.driver)

    def find(self, selector):
        return self.driver.find_elements(By.CSS_SELECTOR, selector)

    def text(self, selector):
        return self.driver.find_element(By.CSS_SELECTOR, selector).text

    def colours(self):
        """How many different colours the canvas shows, and a number that changes with any pixel."""
        return tuple(self.driver.execute_script("""
            const canvas = document.querySelector("canvas"), copy = document.createElement("canvas");
            [copy.width, copy.height] = [canvas.width, canvas.height];
            const context = copy.getContext("2d");
            context.drawImage(canvas, 0, 0);
            const seen = new Set();
            let sum = 0;
            new Uint32Array(context.getImageData(0, 0, copy.width, copy.height).data.buffer).forEach((pixel, i) => {
              seen.add(pixel);
              sum = (31 * sum + pixel) % 4294967291;
            });
            return [seen.size, sum];"""))

    def press(self, key):
        ActionChains(self.driver).send_keys(key).perform()
        browser.draw(self.driver)

    def click_canvas_centre(self):
        ActionChains(self.driver).move_to_element(self.find("canvas")[0]).click().perform()
        browser.draw(self.driver)

    def touch(self, *path):
        """A finger that comes down at the first of some points (pixels off the canvas's middle) and leaves at the last."""
        finger = PointerInput(POINTER_TOUCH, "finger")
        actions = ActionBuilder(self.driver, mouse=finger)
        canvas = self.find("canvas")[0]
        for i, (x, y) in enumerate(path):
            actions.pointer_action.move_to(canvas, x, y)
            if i == 0:
                actions.pointer_action.pointer_down()
        actions.pointer_action.pointer_up()
        actions.perform()
        browser.draw(self.driver)

    def axes(self):
        """Where the corner's three axes point, to what an eye could tell."""
        return [tuple(round(float(line.get_attribute(end)), 3) + 0.0 for end in ("x2", "y2"))
                for line in self.find("#axes line")]

    def selected(self):
        """Rank of the selected part, or None."""
        rows = self.find(".part[aria-current] .rank")
        return int(rows[0].text) if rows else None

    def test_lists_every_part_with_score_and_visible_share(self):
        self.open(self.page)
        rows = self.find(".part")
        self.assertEqual(len(rows), len(self.answer["hypotheses"]))
        best = self.answer["hypotheses"][0]
        self.assertIn(f"{best['score']:.3f}", rows[0].text)
        self.assertIn(f"{100 * best['visibleFraction']:.0f} %", rows[0].text)
        self.assertIn(f"{len(rows)} found in", self.text("#summary"))
        self.assertEqual(self.text("h1"), "bearing_support_01")

    def test_draws_cloud_and_parts_without_a_complaint(self):
        self.open(self.page)
        self.assertGreater(self.colours()[0], 500)
        self.assertEqual(self.driver.get_log("browser"), [])

    def test_a_click_in_the_list_selects_the_part_and_says_its_pose(self):
        self.open(self.page)
        before = self.colours()
        self.find(".part button")[1].click()
        browser.draw(self.driver)
        self.assertEqual(self.selected(), 2)
        x = self.answer["hypotheses"][1]["pose"]["position"]["x"]
        self.assertIn(f"{x:.2f}", self.text(".part[aria-current] dl"))
        self.assertNotEqual(self.colours(), before)

    def test_a_click_on_a_part_in_the_picture_selects_it(self):
        self.open(self.page)
        self.find(".part button")[0].click()  # puts it into the middle
        browser.draw(self.driver)
        self.press(Keys.ESCAPE)
        self.assertIsNone(self.selected())
        self.click_canvas_centre()
        self.assertEqual(self.selected(), 1)

    def test_a_tap_selects_and_one_finger_orbits(self):
        self.open(self.page)
        self.find(".part button")[0].click()  # puts it into the middle
        browser.draw(self.driver)
        self.press(Keys.ESCAPE)
        before = self.axes()
        self.touch((0, 0))
        self.assertEqual(self.selected(), 1)
        self.assertEqual(self.axes(), before)
        self.touch((0, 0), (40, 10), (120, 30))
        self.assertNotEqual(self.axes(), before)
        self.assertEqual(self.selected(), 1, "a drag selects nothing else")

    def test_an_ambiguous_pose_says_so_and_shows_its_variants(self):
        def doubt(data):
            best, second = data["answer"]["hypotheses"][:2]
            best.update(confidence=0.625, variants=[second["pose"]])
        page = self.folder / "ambiguous.html"
        write_changed(page, self.page, doubt)
        self.open(page)
        rows = self.find(".part")
        self.assertIn("ambiguous, 63 % sure", rows[0].text)
        self.assertNotIn("sure", rows[1].text)
        self.driver.find_element(By.CSS_SELECTOR, "[data-shows=truth]").click()
        self.find(".part button")[0].click()
        browser.draw(self.driver)
        self.assertIn("as outlined (1)", self.text(".part[aria-current] dl"))
        outlined = self.colours()
        self.open(self.page)
        self.driver.find_element(By.CSS_SELECTOR, "[data-shows=truth]").click()
        self.find(".part button")[0].click()
        browser.draw(self.driver)
        self.assertIn("confidence", self.text(".part[aria-current] dl"))
        self.assertNotEqual(self.colours(), outlined)

    def test_every_switch_changes_the_picture(self):
        def reject_the_last(data):
            data["answer"]["rejected"] = [data["answer"]["hypotheses"].pop()]
        page = self.folder / "rejected.html"
        write_changed(page, self.page, reject_the_last)
        self.open(page)
        for name in ["cloud", "parts", "truth", "rejected"]:
            before = self.colours()
            self.driver.find_element(By.CSS_SELECTOR, f"[data-shows={name}]").click()
            browser.draw(self.driver)
            self.assertNotEqual(self.colours(), before, name)

    def test_works_by_keyboard(self):
        self.open(self.page)
        self.press(Keys.ARROW_DOWN)
        self.press(Keys.ARROW_DOWN)
        self.assertEqual(self.selected(), 2)
        for key in [Keys.ARROW_RIGHT, "c", "0"]:
            before = self.colours()
            self.press(key)
            self.assertNotEqual(self.colours(), before, key)

    def test_says_how_long_the_scale_bar_is(self):
        self.open(self.page)
        self.assertRegex(self.text("#scale span"), r"^[125]0* mm$")

    def test_fits_a_small_screen(self):
        self.addCleanup(self.driver.set_window_size, 1200, 700)
        self.driver.set_window_size(500, 900)
        self.open(self.page)
        canvas, panel = self.find("canvas")[0].rect, self.find("aside")[0].rect
        self.assertGreaterEqual(panel["y"], canvas["y"] + canvas["height"] - 1)
        self.assertGreater(canvas["height"], 300)

    def test_needs_no_mesh(self):
        page = self.folder / "discs.html"
        self.server.binpose_json("detect", "--model", "part", "--scene", SCENE, "--unit", "m", "--view", page)
        self.open(page)
        self.assertGreater(self.colours()[0], 500)
        self.press(Keys.ARROW_DOWN)
        x = 1000 * self.answer["hypotheses"][0]["pose"]["position"]["x"] / 1000
        self.assertIn(f"{x:.2f}", self.text(".part[aria-current] dl"))

    def test_an_empty_bin_says_why_nothing_was_found(self):
        page = self.folder / "empty.html"
        [answer] = self.server.binpose_json("detect", "--model", "part", "--scene", DATA / "scenes/empty_bin_01",
                                            "--unit", "mm", "--view", page)
        self.open(page)
        self.assertEqual(self.find(".part"), [])
        self.assertEqual(self.text("#warnings"), answer["warnings"][0])

    def test_opens_with_more_than_300_000_points(self):
        scene, page = self.folder / "dense", self.folder / "dense.html"
        count = write_scene_four_times_as_dense(scene)
        self.assertGreater(count, 300_000)
        self.server.binpose_json("detect", "--model", "part", "--scene", scene, "--unit", "mm", "--view", page)
        self.open(page)
        print(f"{count} points: drawn after {self.driver.execute_script('return performance.now()') / 1000:.1f} s")
        self.assertIn(f"{count:,} points", self.text("#summary"))
        self.assertGreater(self.colours()[0], 500)

    def test_names_are_text_and_never_markup(self):
        scene = self.folder / "<img src=x onerror=alert(1)> <!--<script>"
        shutil.copytree(SCENE, scene)
        page = self.folder / "hostile.html"
        self.server.binpose_json("detect", "--model", "part", "--scene", scene, "--unit", "mm", "--view", page)
        self.open(page)
        self.assertEqual(self.text("h1"), scene.name)
        self.assertEqual(self.find("img"), [])

    def test_reaches_for_nothing_outside_itself(self):
        self.open(self.page)
        loaded = self.driver.execute_script("return performance.getEntriesByType('resource').map((entry) => entry.name)")
        self.assertEqual(loaded, [])

    def test_damaged_data_are_said_to_be_so(self):
        page = self.folder / "damaged.html"
        page.write_text(self.page.read_text().replace('"kind":"result"', '"kind":"result'))
        self.open(page, state="failed")
        self.assertIn("cannot be shown", self.text("#fault"))

    def test_a_model_shows_its_observability_and_pairs(self):
        self.open(self.model_page)
        self.assertEqual(self.driver.get_log("browser"), [])
        self.assertIn(f"of {self.model['pairCount']} vector pairs", self.text("#list"))
        self.assertIn(self.model["contentHash"], self.text("dl"))
        for name in ["surface", "vector", "frame"]:
            before = self.colours()
            self.driver.find_element(By.CSS_SELECTOR, f"[data-shows={name}]").click()
            browser.draw(self.driver)
            self.assertNotEqual(self.colours(), before, name)

    def test_more_pairs_are_shown_on_demand(self):
        self.open(self.model_page)
        before = self.colours()
        self.find("#pair-count")[0].send_keys(Keys.END)
        browser.draw(self.driver)
        self.assertIn(f"the best {self.model['pairCount']} of", self.text("#list"))
        self.assertNotEqual(self.colours(), before)

    def test_a_model_shows_its_axes_of_symmetry(self):
        write_box(self.folder / "box.stl", 80, 50, 30)
        self.server.binpose_json("train", "--id", "box", "--mesh", self.folder / "box.stl", "--unit", "mm")
        page = self.folder / "box.html"
        self.server.binpose_json("model", "box", "--view", page)
        self.open(page)
        self.assertEqual(self.text("[data-fact=symmetry]"), "2-fold x 3")
        before = self.colours()
        self.press("y")
        self.assertNotEqual(self.colours(), before)

    def test_a_model_shows_an_axis_of_revolution_and_poses_nearly_alike(self):
        def turn_about_z(degrees):
            half = math.radians(degrees) / 2
            return {"position": {}, "orientation": {"z": math.sin(half), "w": math.cos(half)}}
        def change(data):
            data["model"]["symmetry"]["axis"] = {"point": {}, "direction": {"x": 0, "y": 1, "z": 0}}
            data["model"]["similarPoses"] = [turn_about_z(-90), turn_about_z(90)]
        page = self.folder / "revolution.html"
        write_changed(page, self.model_page, change)
        self.open(page)
        self.assertEqual(self.text("[data-fact=symmetry]"), "any turn; nearly, 90° 270°")

    def test_one_page_shows_one_scene(self):
        run = self.server.binpose("detect", "--model", "part", "--scene", SCENE, SCENE, "--unit", "mm", "--view", self.page)
        self.assertEqual(run.returncode, 2)
        self.assertIn("--view", run.stderr)

    def test_a_page_that_cannot_be_written_is_named(self):
        run = self.server.binpose("model", "part", "--view", self.folder / "missing/model.html")
        self.assertEqual(run.returncode, 3)
        self.assertIn("missing/model.html", run.stderr)


if __name__ == "__main__":
    if "not in this build" in Server.help("detect"):
        print("binpose was built without the viewer")
        sys.exit(NOT_BUILT)
    unittest.main()
