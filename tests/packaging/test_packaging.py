#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The table of the downloads' libraries, what makes programs run with an older glibc, and what debian/ repeats."""
import pathlib, re, subprocess, tempfile, unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PACKAGING = ROOT / "packaging"

# f has a version before 2.28 and one behind, new_f is from behind it alone.
LIBRARY = r"""
__asm__(".symver old_f,f@GLIBC_2.2.5");
__asm__(".symver newer_f,f@@GLIBC_2.29");
int old_f(void) { return 1; }
int newer_f(void) { return 2; }
int new_f(void) { return 3; }
"""
VERSIONS = "GLIBC_2.2.5 { global: f; local: *; }; GLIBC_2.29 { global: f; }; GLIBC_2.30 { global: new_f; };"
WAITS = r"""
#define pthread_cond_clockwait waits
#define PART 4
#include "glibc_support.c"
int main(void) {
    pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
    pthread_cond_t condition = PTHREAD_COND_INITIALIZER;
    struct timespec begin, end, until;
    clock_gettime(CLOCK_MONOTONIC, &begin);
    until = begin;
    until.tv_nsec += 30000000;
    if (until.tv_nsec >= 1000000000) until.tv_sec += 1, until.tv_nsec -= 1000000000;
    pthread_mutex_lock(&mutex);
    const int result = waits(&condition, &mutex, CLOCK_MONOTONIC, &until);
    clock_gettime(CLOCK_MONOTONIC, &end);
    const double ms = (end.tv_sec - begin.tv_sec) * 1e3 + (end.tv_nsec - begin.tv_nsec) * 1e-6;
    return result == ETIMEDOUT && ms > 25 ? 0 : 1;
}
"""
FRAMES = r"""
#define _GNU_SOURCE
#include <link.h> // a new one has the function itself
#undef _GNU_SOURCE
#define _dl_find_object finds
#define dl_find_object found_object
#define PART 3
#include "glibc_support.c"
int main(void) {
    struct found_object of_main, of_libc;
    return finds((void*)main, &of_main) == 0 && finds((void*)abort, &of_libc) == 0 && finds((void*)1, &of_main) == -1 &&
                   (void*)main >= of_main.map_start && (void*)main < of_main.map_end && of_main.eh_frame != of_libc.eh_frame
               ? 0 : 1;
}
"""
OWNED = r"""
#include "thread_owned.h"
#include <thread>
static int deleted = 0;
int main() {
    bool other = true;
    {
        thread_specific_ptr<int> value([](int* v) { deleted += *v; delete v; });
        value.reset(new int(1));
        std::thread([&] { other = value.get() != nullptr; value.reset(new int(10)); }).join();
        if (other || *value != 1 || deleted != 10) return 1;
        value.reset(new int(100));
        if (deleted != 11) return 2;
    }
    return deleted == 111 ? 0 : 3;
}
"""


class Table(unittest.TestCase):
    def setUp(self):
        lines = (PACKAGING / "dependencies.txt").read_text().splitlines()
        self.rows = [line.split() for line in lines if line and not line.startswith("#")]

    def test_each_row_has_a_name_a_sum_and_an_archive(self):
        for row in self.rows:
            self.assertEqual(len(row), 3, row)
            self.assertRegex(row[1], "^[0-9a-f]{64}$", row)
            self.assertRegex(row[2], r"\.(deb|tar\.(gz|bz2|xz)|diff\.gz)$", row)

    def test_each_library_with_sources_has_a_recipe(self):
        recipes = set(re.findall(r"^build_(\w+)\(\)", (PACKAGING / "recipes.sh").read_text(), re.M))
        names = {name.replace("-", "_") for name, *_ in self.rows}
        self.assertEqual(recipes - names, set())
        self.assertEqual({name.replace("-", "_") for name, _, archive in self.rows if ".orig.tar" in archive and not name.startswith("system-")} - recipes, {"lavapipe"})

    def test_the_scripts_are_bash(self):
        for name in ("toolchain", "dependencies", "recipes.sh", "glibc-of", "lavapipe"):
            subprocess.run(["bash", "-n", PACKAGING / name], check=True)

    def test_the_driver_is_refused_where_llvm_is_not_in_the_table(self):
        for target, status, words in (("linux-aarch64", 1, "no driver"), ("windows-x86_64", 1, "no driver"), ("", 2, "packaging/lavapipe")):
            done = subprocess.run([PACKAGING / "lavapipe", target], capture_output=True, text=True)
            self.assertEqual((done.returncode, words in done.stderr), (status, True), done)


class Glibc(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def build(self, name, text, *options):
        source = self.folder / f"{name}.c"
        source.write_text(text)
        compiler = ["c++"] if "thread_owned" in text else ["c++", "-x", "c", "-std=gnu11"]
        return subprocess.run([*compiler, "-Wall", "-Wextra", f"-I{PACKAGING}", source, "-x", "none", "-o", self.folder / name, "-pthread", *options],
                              capture_output=True, text=True)

    def runs(self, name, text):
        self.assertEqual(self.build(name, text).stderr, "")
        self.assertEqual(subprocess.run([self.folder / name]).returncode, 0)

    def glibc_of(self, name):
        return subprocess.run([PACKAGING / "glibc-of", self.folder / name], capture_output=True, text=True)

    def test_a_library_links_as_an_older_one(self):
        (self.folder / "versions").write_text(VERSIONS)
        library = self.folder / "libolder.so"
        built = self.build("libolder.so", LIBRARY, "-shared", "-fPIC", f"-Wl,--version-script={self.folder / 'versions'}")
        self.assertEqual(built.stderr, "")
        program = "int f(void); int main(void) { return f(); }"
        link = (library, f"-Wl,-rpath,{self.folder}", "-nostartfiles", "-Wl,-e,main")
        self.assertEqual(self.build("before", program, *link).stderr, "")
        before = self.glibc_of("before")
        self.assertEqual((before.returncode, "GLIBC_2.29 f" in before.stderr), (1, True), before)

        subprocess.run([PACKAGING / "age_glibc.py", "2.28", library], check=True, capture_output=True)
        self.assertEqual(self.build("after", program, *link).stderr, "")
        after = self.glibc_of("after")
        self.assertEqual((after.returncode, after.stdout.split()[0]), (0, "2.2.5"), after)
        self.assertIn("undefined reference", self.build("new", program.replace("f(", "new_f("), *link).stderr)

    def test_functions_of_later_versions(self):
        self.runs("waits", WAITS)
        self.runs("frames", FRAMES)

    def test_each_thread_owns_its_value(self):
        self.runs("owned", OWNED)


class Debian(unittest.TestCase):
    def setUp(self):
        self.control = (ROOT / "debian/control").read_text()
        self.install = (ROOT / "cmake/EwaInstall.cmake").read_text()

    def list_of(self, field, package="ewa"):
        stanza = re.search(rf"^(?:Source|Package): {package}\n.*?^{field}:(.*?)^(?=\S|\Z)", self.control, re.M | re.S)
        return {re.sub(r" \(.*?\)", "", name).strip() for name in stanza.group(1).split(",")}

    def set_in_cmake(self, name):
        return re.search(rf'^ *set\({name} "?(.*?)"?\)$', self.install, re.M).group(1)

    def test_the_build_has_the_packages_of_the_scripts(self):
        scripts = set(re.search(r"\[build\]='(.*?)'", (ROOT / "scripts/install-packages").read_text(), re.S).group(1).split())
        # Of each package that builds, of cpack, of the developer, and of the tests. libopenmpi-dev brings openmpi-bin.
        scripts -= {"g++", "dpkg-dev", "file", "ccache", "mesa-vulkan-drivers", "fonts-dejavu-core", "openmpi-bin"}
        self.assertEqual(self.list_of("Build-Depends"), scripts | {"debhelper-compat"})

    def test_both_recommend_the_same(self):
        self.assertEqual(self.list_of("Recommends", "ewa"), set(self.set_in_cmake("CPACK_DEBIAN_PACKAGE_RECOMMENDS").split(", ")))

    def test_the_packages_have_one_version_and_maintainer(self):
        version = re.search(r"project\(ewa VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text()).group(1)
        changelog = (ROOT / "debian/changelog").read_text()
        self.assertTrue(changelog.startswith(f"ewa ({version}-"), changelog)
        self.assertIn(f"\nPackage: libewa{version.rpartition('.')[0]}\n", self.control)
        self.assertEqual(self.list_of("Maintainer"), {self.set_in_cmake("CPACK_PACKAGE_CONTACT")})

    def test_cpack_excludes_the_others(self):
        others = set(re.findall(r"^Package: (\S+)", self.control, re.M)) - {"ewa", "ewa-mpi"}
        for field in ("CONFLICTS", "REPLACES"):
            self.assertEqual(set(self.set_in_cmake(f"CPACK_DEBIAN_PACKAGE_{field}").split(", ")), others)


if __name__ == "__main__":
    unittest.main()
