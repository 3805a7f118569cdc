// SPDX-License-Identifier: Apache-2.0
// The dialog that asks for a file: the program zenity, the desktop's portal on a bus of the test's own, and the keys.
#include "viewer/file_dialog.h"

#include <sys/stat.h>

#include <atomic>
#include <thread>

#include "core/process.h"
#include "ewa/error.h"
#include "viewer/session.h"
#include "viewer/variable.h"
#ifdef EWA_PORTAL
#include <systemd/sd-bus.h>
#endif

namespace ewa::test {
namespace {

namespace fs = std::filesystem;
using viewer::FileDialog;
using viewer::Wanted;

const std::string kNoBus = "unix:path=/nonexistent/bus";

void make_zenity(const Folder& folder, const std::string& script) {
    fs::create_directories(folder / "bin");
    write_file(folder / "bin/zenity", "#!/bin/sh\n" + script);
    chmod((folder / "bin/zenity").c_str(), 0755);
}

std::optional<fs::path> answer(Wanted wanted, const fs::path& proposed = {}) {
    FileDialog dialog([] {});
    dialog.ask(wanted, proposed);
    EXPECT_EQ(dialog.wanted(), wanted);
    std::optional<fs::path> chosen;
    EXPECT_TRUE(soon([&] {
        chosen = dialog.take();
        return chosen || !dialog.open();
    }));
    return chosen;
}

TEST(TheFileDialog, IsZenityWithoutAPortal) {
    const Folder folder;
    const Variable bus("DBUS_SESSION_BUS_ADDRESS", kNoBus), path("PATH", folder / "bin" + ":/usr/bin:/bin");
    make_zenity(folder, "echo \"/a folder/$# $3\"");
    EXPECT_EQ(answer(Wanted::file), "/a folder/2 ");
    EXPECT_EQ(answer(Wanted::folder), "/a folder/3 --directory");
    make_zenity(folder, "exit 1");
    EXPECT_FALSE(answer(Wanted::file)) << "it was cancelled";
}

TEST(TheFileDialog, SavesUnderAProposedName) {
    const Folder folder;
    const Variable bus("DBUS_SESSION_BUS_ADDRESS", kNoBus), path("PATH", folder / "bin" + ":/usr/bin:/bin");
    make_zenity(folder, "echo \"/$# $2 $3 $4\"");
    EXPECT_EQ(answer(Wanted::save, "/a folder/x.ply"), "/4 --title=Save --save --filename=/a folder/x.ply");
    EXPECT_EQ(answer(Wanted::save, "x.ply"),
              "/4 --title=Save --save --filename=" + fs::absolute("x.ply").string());
    EXPECT_EQ(answer(Wanted::file), "/2 --title=Open  ");
    fs::rename(folder / "bin/zenity", folder / "bin/kdialog");
    const Variable own("PATH", folder / "bin");  // /usr/bin may have a zenity
    EXPECT_EQ(answer(Wanted::save, "/a folder/x.ply"), "/2 /a folder/x.ply  ");
}

TEST(TheFileDialog, ThatIsMissingSaysWhatToInstall) {
    const Folder folder;
    const Variable bus("DBUS_SESSION_BUS_ADDRESS", kNoBus), path("PATH", folder / "bin");
    for (const auto& [wanted, advice] :
         {std::pair(Wanted::file, "drop the file"), {Wanted::save, "type the path"}})
        try {
            answer(wanted);
            FAIL() << "nothing was thrown";
        } catch (const RunError& error) {
            EXPECT_NE(std::string(error.what()).find("apt install zenity"), std::string::npos)
                << error.what();
            EXPECT_NE(std::string(error.what()).find(advice), std::string::npos) << error.what();
        }
}

TEST(TheFileDialog, IsClosedWithTheWindow) {
    const Folder folder;
    const Variable bus("DBUS_SESSION_BUS_ADDRESS", kNoBus), path("PATH", folder / "bin" + ":/usr/bin:/bin");
    make_zenity(folder, "echo $$ > " + folder / "pid" + "; exec sleep 1000");
    {
        FileDialog dialog([] {});
        dialog.ask(Wanted::file);
        dialog.ask(Wanted::folder);  // one is open
        ASSERT_TRUE(soon([&] { return fs::exists(folder / "pid") && !read_file(folder / "pid").empty(); }));
    }
    EXPECT_FALSE(fs::exists("/proc/" + std::to_string(std::stoi(read_file(folder / "pid")))));
}

TEST(TheFileDialog, ReadsUris) {
    EXPECT_EQ(viewer::path_of_uri("file:///a%20b/%c3%BC.ply"), "/a b/\xc3\xbc.ply");
    EXPECT_EQ(viewer::path_of_uri("file://host/a%2"), "/a%2");
    EXPECT_EQ(viewer::path_of_uri("file:///100%zz"), "/100%zz");
    EXPECT_EQ(viewer::path_of_uri("http://host/a"), "");
    EXPECT_EQ(viewer::path_of_uri("file://host"), "");
}

#ifdef EWA_PORTAL
/// A session bus of its own, and on it a portal that answers with this URI. Without one it answers that the user cancelled.
class FakePortal {
  public:
    FakePortal(const Folder& folder, std::string uri) : uri_(std::move(uri)) {
        write_file(folder / "bus.conf",
                   "<busconfig><type>session</type><listen>unix:path=" + folder / "bus" +
                       "</listen><policy context=\"default\"><allow send_destination=\"*\"/><allow "
                       "receive_sender=\"*\"/><allow own=\"*\"/></policy></busconfig>");
        daemon_ =
            core::start_program({"dbus-daemon", "--config-file=" + folder / "bus.conf", "--nofork"}, {}, {});
        address_ = "unix:path=" + folder / "bus";
        // Between the socket's file and the first connection that it takes, the daemon refuses.
        const auto connected = [&] {
            bus_ = sd_bus_unref(bus_);
            sd_bus_new(&bus_);
            sd_bus_set_address(bus_, address_.c_str());
            sd_bus_set_bus_client(bus_, 1);
            return sd_bus_start(bus_) >= 0;
        };
        if (!soon([&] { return fs::exists(folder / "bus") && connected(); })) return;
        static const sd_bus_vtable methods[] = {
            SD_BUS_VTABLE_START(0), SD_BUS_METHOD("OpenFile", "ssa{sv}", "o", opened, 0),
            SD_BUS_METHOD("SaveFile", "ssa{sv}", "o", opened, 0), SD_BUS_VTABLE_END};
        ready_ = sd_bus_add_object_vtable(bus_, nullptr, "/org/freedesktop/portal/desktop",
                                          "org.freedesktop.portal.FileChooser", methods, this) >= 0 &&
                 sd_bus_request_name(bus_, "org.freedesktop.portal.Desktop", 0) >= 0;
        thread_ = std::thread([this] {
            while (!stop_) {
                if (sd_bus_process(bus_, nullptr) == 0) sd_bus_wait(bus_, 20000);
            }
        });
    }
    ~FakePortal() {
        stop_ = true;
        if (thread_.joinable()) thread_.join();
        sd_bus_unref(bus_);
        daemon_.kill();
        daemon_.wait();
    }
    FakePortal(const FakePortal&) = delete;
    FakePortal& operator=(const FakePortal&) = delete;

    bool ready() const { return ready_; }
    const std::string& address() const { return address_; }
    bool asked_for_folder() const { return folder_; }
    /// The path that the last dialog proposed. Call it after the answer.
    std::string proposed() const { return proposed_; }

  private:
    static int opened(sd_bus_message* call, void* data, sd_bus_error* /*error*/) {
        auto& self = *static_cast<FakePortal*>(data);
        const char *parent = nullptr, *title = nullptr, *name = nullptr, *token = "";
        sd_bus_message_read(call, "ss", &parent, &title);
        sd_bus_message_enter_container(call, 'a', "{sv}");
        while (sd_bus_message_enter_container(call, 'e', "sv") > 0) {
            int folder = 0;
            sd_bus_message_read(call, "s", &name);
            if (name == std::string("handle_token")) sd_bus_message_read(call, "v", "s", &token);
            if (name == std::string("directory")) {
                sd_bus_message_read(call, "v", "b", &folder);
                self.folder_ = folder != 0;
            }
            if (name == std::string("current_name")) {
                const char* text = "";
                sd_bus_message_read(call, "v", "s", &text);
                self.proposed_ = text;
            }
            if (name == std::string("current_folder")) {
                const void* bytes = nullptr;
                size_t count = 0;
                sd_bus_message_enter_container(call, 'v', "ay");
                sd_bus_message_read_array(call, 'y', &bytes, &count);
                sd_bus_message_exit_container(call);
                self.proposed_ =
                    std::string(static_cast<const char*>(bytes), count - 1) + "/" + self.proposed_;
            }
            sd_bus_message_exit_container(call);
        }
        std::string sender = sd_bus_message_get_sender(call) + 1;
        std::replace(sender.begin(), sender.end(), '.', '_');
        const std::string request = "/org/freedesktop/portal/desktop/request/" + sender + "/" + token;
        sd_bus_reply_method_return(call, "o", request.c_str());
        const char* interface = "org.freedesktop.portal.Request";
        if (self.uri_.empty())
            return sd_bus_emit_signal(self.bus_, request.c_str(), interface, "Response", "ua{sv}", 1u, 0);
        return sd_bus_emit_signal(self.bus_, request.c_str(), interface, "Response", "ua{sv}", 0u, 2,
                                  "choices", "a(ss)", 0, "uris", "as", 1, self.uri_.c_str());
    }

    std::string uri_, address_, proposed_;
    platform::Process daemon_;
    sd_bus* bus_ = nullptr;
    bool ready_ = false;
    std::atomic<bool> stop_ = false, folder_ = false;
    std::thread thread_;
};

TEST(TheFileDialog, IsThePortals) {
    if (core::find_program("dbus-daemon").empty()) GTEST_SKIP() << "there is no dbus-daemon";
    const Folder folder;
    make_zenity(folder, "echo /wrong");
    const Variable path("PATH", folder / "bin" + ":/usr/bin:/bin");
    {
        const FakePortal portal(folder, "file:///a%20folder/splats.ply");
        ASSERT_TRUE(portal.ready());
        const Variable bus("DBUS_SESSION_BUS_ADDRESS", portal.address());
        EXPECT_EQ(answer(Wanted::file), "/a folder/splats.ply");
        EXPECT_FALSE(portal.asked_for_folder());
        EXPECT_EQ(answer(Wanted::folder), "/a folder/splats.ply");
        EXPECT_TRUE(portal.asked_for_folder());
        EXPECT_EQ(portal.proposed(), "");
        EXPECT_EQ(answer(Wanted::save, "/a b/x.ply"), "/a folder/splats.ply");
        EXPECT_EQ(portal.proposed(), "/a b/x.ply");
    }
    fs::remove(folder / "bus");
    const FakePortal portal(folder, "");
    ASSERT_TRUE(portal.ready());
    const Variable bus("DBUS_SESSION_BUS_ADDRESS", portal.address());
    EXPECT_FALSE(answer(Wanted::file)) << "it was cancelled";
}
#endif

class OpenKeys : public SessionTest {};

TEST_F(OpenKeys, AndTheButtonsOpenWhatIsChosen) {
    make_zenity(folder_, "echo \"$*\" >> " + folder_ / "asked" + "; echo " + splats_);
    Session session(shots_, {"--size", "400x300"},
                    {{"PATH", folder_ / "bin" + ":/usr/bin:/bin"}, {"DBUS_SESSION_BUS_ADDRESS", kNoBus}});
    ASSERT_TRUE(session.found());
    EXPECT_EQ(range_of(screenshot(session)), 0);
    session.send("mousemove 136 197 click 1");  // the button of a file
    const XClient display(display_.name());
    EXPECT_TRUE(display.window_titled("splats.ply - ewa")) << "nothing was opened";
    EXPECT_GT(range_of(screenshot(session)), 0.3f);
    session.send("key ctrl+shift+o");
    EXPECT_TRUE(soon([&] { return read_file(folder_ / "asked").find("--directory") != std::string::npos; }));
    session.send("key ctrl+o");
    EXPECT_TRUE(soon([&] {
        const std::string asked = read_file(folder_ / "asked");
        return std::count(asked.begin(), asked.end(), '\n') == 3;
    }));
    expect_silent(session.quit());
}

TEST_F(OpenKeys, TakeATypedPathWithoutADialog) {
    Session session(shots_, {"--size", "640x480"},
                    {{"PATH", folder_ / "bin"}, {"DBUS_SESSION_BUS_ADDRESS", kNoBus}});
    ASSERT_TRUE(session.found());
    EXPECT_EQ(range_of(screenshot(session)), 0);
    // A key that comes before the dialog has the focus is lost, so the dialog is opened again.
    constexpr int kTries = 6;
    bool there = false;
    for (int i = 0; i < kTries && !there; ++i) {
        session.send("key ctrl+o sleep 2 key ctrl+a type --delay 20 " + splats_);
        session.send("sleep 1 key Return");
        there = soon([&] { return fs::exists(config_ + "/ewa/recent.json"); }, kSessionPatience / kTries);
        if (!there) session.send("key Escape sleep 1");
    }
    EXPECT_TRUE(there) << "nothing was opened";
    EXPECT_GT(range_of(screenshot(session)), 0.3f);
    expect_silent(session.quit());
}

}  // namespace
}  // namespace ewa::test
