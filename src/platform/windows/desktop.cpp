// SPDX-License-Identifier: Apache-2.0
#include "platform/desktop.h"

#include <atomic>
#include <thread>

#include "platform/windows/windows.h"
// After windows.h.
#include <objbase.h>
#include <shellapi.h>
#include <shobjidl.h>

namespace ewa::platform {
namespace {

namespace fs = std::filesystem;

constexpr DWORD kLook = 100;  // ms between looks at `stop`

/// An object of Windows' component model.
template <class T>
struct Component {
    T* object = nullptr;
    ~Component() {
        if (object) object->Release();
    }
};

/// COM on this thread.
struct Apartment {
    HRESULT opened = CoInitializeEx(nullptr, COINIT_APARTMENTTHREADED);
    ~Apartment() {
        if (SUCCEEDED(opened)) CoUninitialize();
    }
};

fs::path path_of(IShellItem* item) {
    wchar_t* name = nullptr;
    fs::path path;
    if (SUCCEEDED(item->GetDisplayName(SIGDN_FILESYSPATH, &name))) path = name;
    CoTaskMemFree(name);
    return path;
}

/// Begins in the folder of the path, with its name.
void propose(IFileDialog* dialog, const fs::path& proposed) {
    Component<IShellItem> folder;
    const fs::path above = fs::path(proposed.parent_path()).make_preferred();
    if (SUCCEEDED(SHCreateItemFromParsingName(above.c_str(), nullptr, IID_PPV_ARGS(&folder.object))))
        dialog->SetFolder(folder.object);
    dialog->SetFileName(proposed.filename().c_str());
}

/// The dialogs that a thread has open end as if the user had pressed Escape.
BOOL CALLBACK close_window(HWND window, LPARAM) {
    PostMessageW(window, WM_CLOSE, 0, 0);
    return TRUE;
}

}  // namespace

bool has_desktop() {
    return true;
}

std::string open_outside(const fs::path& file, const std::string& /*remedy*/) {
    const Apartment apartment;
    const fs::path whole = fs::absolute(file).make_preferred();
    const auto result = reinterpret_cast<INT_PTR>(
        ShellExecuteW(nullptr, L"open", whole.c_str(), nullptr, nullptr, SW_SHOWNORMAL));
    return result > 32 ? "" : "Windows has no program that opens this file";
}

bool choose(Choice choice, const fs::path& proposed, const std::atomic<bool>& stop, fs::path& chosen) {
    const Apartment apartment;
    Component<IFileDialog> dialog;
    const CLSID& kind = choice == Choice::save ? CLSID_FileSaveDialog : CLSID_FileOpenDialog;
    if (FAILED(CoCreateInstance(kind, nullptr, CLSCTX_INPROC_SERVER, IID_PPV_ARGS(&dialog.object))))
        return false;
    DWORD options = 0;
    dialog.object->GetOptions(&options);
    options |= FOS_FORCEFILESYSTEM | FOS_NOCHANGEDIR;
    if (choice == Choice::folder) options |= FOS_PICKFOLDERS;
    dialog.object->SetOptions(options);
    if (!proposed.empty()) propose(dialog.object, proposed);
    const DWORD thread = GetCurrentThreadId();
    const std::jthread closer([&stop, thread](const std::stop_token& ended) {
        while (!ended.stop_requested()) {
            if (stop) EnumThreadWindows(thread, close_window, 0);
            Sleep(kLook);
        }
    });
    Component<IShellItem> item;
    if (SUCCEEDED(dialog.object->Show(nullptr)) && SUCCEEDED(dialog.object->GetResult(&item.object)))
        chosen = path_of(item.object);
    return true;
}

}  // namespace ewa::platform
