// Runs fire-atlas build and reads what it says. Written by fire-atlas plugin unity.

namespace FireAtlas.Editor
{
    using global::System;
    using global::System.Collections.Concurrent;
    using global::System.Collections.Generic;
    using global::System.Diagnostics;
    using global::System.IO;
    using global::System.Linq;
    using global::System.Text;
    using global::UnityEngine;

    /// <summary>A build of recipes by the command line, which runs beside the editor.</summary>
    public sealed class RecipeBuild : IDisposable
    {
        /// <summary>Endings of recipes.</summary>
        public static readonly string[] Endings = { ".fire", ".yaml", ".yml" };

        /// <summary>A line that the build prints: see JSON lines in its documentation.</summary>
        [Serializable]
        public sealed class Line
        {
            public string @event = "";
            public string recipe = "";
            public string stage = "";
            public string message = "";
            public int done = 0;
            public int total = 0;
            public bool fresh = false;
            public string[] files = new string[0];
        }

        readonly Process process;
        readonly ConcurrentQueue<string> lines = new ConcurrentQueue<string>();
        readonly ConcurrentQueue<string> complaints = new ConcurrentQueue<string>();

        RecipeBuild(Process process)
        {
            this.process = process;
            process.OutputDataReceived += (_, line) => { if (line.Data != null) lines.Enqueue(line.Data); };
            process.ErrorDataReceived += (_, line) => { if (line.Data != null) complaints.Enqueue(line.Data); };
        }

        /// <summary>0 if all were built or up to date.</summary>
        public int ExitCode
        {
            get { return process.ExitCode; }
        }

        /// <summary>Returns whether a file is a recipe, by its ending.</summary>
        public static bool IsRecipe(string path)
        {
            return Endings.Any(ending => path.EndsWith(ending, StringComparison.Ordinal));
        }

        /// <summary>Returns the arguments that build recipes: files, and folders for all in them.</summary>
        public static string Arguments(IEnumerable<string> recipes)
        {
            return "build --json " + string.Join(" ", recipes.Select(Quoted));
        }

        /// <summary>Starts to build.</summary>
        /// <param name="command">The program fire-atlas: its name, or its path. See RecipeProgram.Find.</param>
        /// <param name="recipes">Files and folders, relative to the folder it runs in.</param>
        /// <param name="folder">Where it runs: the folder of the project.</param>
        /// <exception cref="System.ComponentModel.Win32Exception">There is no such program.</exception>
        public static RecipeBuild Start(string command, IEnumerable<string> recipes, string folder)
        {
            var how = new ProcessStartInfo(RecipeProgram.Find(command, folder), Arguments(recipes))
            {
                WorkingDirectory = folder,
                UseShellExecute = false,
                CreateNoWindow = true,
                RedirectStandardOutput = true,
                RedirectStandardError = true,
                StandardOutputEncoding = Encoding.UTF8,
                StandardErrorEncoding = Encoding.UTF8,
            };
            how.EnvironmentVariables["PYTHONIOENCODING"] = "utf-8";
            var process = new Process { StartInfo = how };
            var build = new RecipeBuild(process);
            process.Start();
            process.BeginOutputReadLine();
            process.BeginErrorReadLine();
            return build;
        }

        /// <summary>Passes on what was printed since the last call; returns false after the end.</summary>
        public bool Poll(Action<Line> said)
        {
            bool ended = process.HasExited;
            if (ended) process.WaitForExit(); // for the last lines, which other threads read
            string text;
            while (lines.TryDequeue(out text))
            {
                Line line = Parsed(text);
                if (line != null) said(line);
            }
            return !ended;
        }

        /// <summary>What was printed to the error stream, for a failure that no line reports.</summary>
        public string Complaints()
        {
            return string.Join("\n", complaints.ToArray());
        }

        /// <summary>Stops the build; what earlier builds wrote stays whole.</summary>
        public void Stop()
        {
            try
            {
                process.Kill();
            }
            catch (InvalidOperationException) // it ended by itself
            {
            }
        }

        public void Dispose()
        {
            process.Dispose();
        }

        static Line Parsed(string text)
        {
            try
            {
                return JsonUtility.FromJson<Line>(text);
            }
            catch (ArgumentException) // not JSON
            {
                return null;
            }
        }

        /// <summary>Returns a path as one argument; quotes occur in names where \ is no separator.</summary>
        static string Quoted(string path)
        {
            string plain = Path.DirectorySeparatorChar == '\\'
                ? path.Replace('\\', '/')
                : path.Replace("\\", "\\\\").Replace("\"", "\\\"");
            return "\"" + plain + "\"";
        }
    }
}
