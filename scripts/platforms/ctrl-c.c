/* Starts a program of Windows', presses Ctrl-C in its console once a file beside it appears whose name begins so,
 * and ends with the program's exit code: ctrl-c.exe BEGINNING PROGRAM ARGUMENTS */
#include <stdio.h>
#include <string.h>
#include <windows.h>

static int is_there(const char *beginning) {
    char pattern[MAX_PATH];
    WIN32_FIND_DATAA found;
    snprintf(pattern, sizeof pattern, "%s*", beginning);
    HANDLE search = FindFirstFileA(pattern, &found);
    if (search == INVALID_HANDLE_VALUE) return 0;
    FindClose(search);
    return 1;
}

int main(int argc, char **argv) {
    char line[8192] = "";
    STARTUPINFOA startup = {.cb = sizeof startup};
    PROCESS_INFORMATION child;
    DWORD code = 1;
    for (int i = 2; i < argc; i++) {
        strcat(line, "\"");
        strcat(line, argv[i]);
        strcat(line, "\" ");
    }
    AllocConsole();
    if (!CreateProcessA(NULL, line, NULL, NULL, TRUE, 0, NULL, NULL, &startup, &child)) {
        fprintf(stderr, "CreateProcess: %lu\n", GetLastError());
        return 1;
    }
    for (int tries = 0; !is_there(argv[1]); tries++) {
        if (tries == 6000 || WaitForSingleObject(child.hProcess, 10) == WAIT_OBJECT_0) {
            fprintf(stderr, "there was no file %s*\n", argv[1]);
            return 1;
        }
    }
    Sleep(300);
    SetConsoleCtrlHandler(NULL, TRUE); /* not this process */
    if (!GenerateConsoleCtrlEvent(CTRL_C_EVENT, 0)) {
        fprintf(stderr, "GenerateConsoleCtrlEvent: %lu\n", GetLastError());
        TerminateProcess(child.hProcess, 1);
        return 1;
    }
    WaitForSingleObject(child.hProcess, INFINITE);
    GetExitCodeProcess(child.hProcess, &code);
    return (int)code;
}
