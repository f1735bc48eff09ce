"""Debian's Chromium without a window, drawing in software."""

import time

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service

ARGUMENTS = ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--hide-scrollbars", "--use-gl=angle",
             "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


def start(width=1200, height=700):
    options = Options()
    for argument in [*ARGUMENTS, f"--window-size={width},{height}"]:
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    return webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)


def wait(condition, seconds=30):
    """What `condition` returns once it is true."""
    end = time.monotonic() + seconds
    while not (value := condition()):
        if time.monotonic() > end:
            raise AssertionError("waited in vain")
        time.sleep(0.05)
    return value


def open_page(driver, path):
    """Loads a page of `binpose --view`; returns its state once it has drawn or failed."""
    driver.get(path.as_uri())
    return wait(lambda: driver.execute_script("return document.body.dataset.state"))


def draw(driver):
    """Returns when what was asked for is on the canvas."""
    driver.execute_async_script("const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(done))")
