// Finds the program fire-atlas. Written by fire-atlas plugin unity.

namespace FireAtlas.Editor
{
    using global::System;
    using global::System.ComponentModel;
    using global::System.IO;
    using global::System.Linq;
    using global::System.Text.RegularExpressions;

    /// <summary>
    /// Finds the program that builds recipes. A project may come from anyone, and may hold a program
    /// of that name: such a one runs only if the user has named its path.
    /// </summary>
    public static class RecipeProgram
    {
        const int FileNotFound = 2;

        static readonly bool OnWindows = Path.DirectorySeparatorChar == '\\';
        static readonly Regex Absolute = new Regex(OnWindows ? @"^([A-Za-z]:|[\\/])[\\/]" : "^/");
        static readonly char[] InPaths = { Path.DirectorySeparatorChar, Path.AltDirectorySeparatorChar, Path.VolumeSeparatorChar };

        /// <summary>Returns the whole path of a program.</summary>
        /// <param name="command">
        /// A name, which is looked for in the folders of the PATH, but in none that is relative or lies in
        /// a project, as npm's node_modules/.bin does; or a path, which is taken as it is.
        /// </param>
        /// <param name="project">The folder in which a relative path begins.</param>
        /// <exception cref="System.ComponentModel.Win32Exception">There is no such program.</exception>
        public static string Find(string command, string project)
        {
            string plain = Unquoted(command);
            string found = plain.IndexOfAny(InPaths) < 0 ? OnPath(plain) : Joined(project, plain);
            if (found == null) throw new Win32Exception(FileNotFound);
            return found;
        }

        static string OnPath(string name)
        {
            string file = OnWindows && !name.EndsWith(".exe", StringComparison.OrdinalIgnoreCase) ? name + ".exe" : name;
            string folders = Environment.GetEnvironmentVariable("PATH") ?? "";
            return folders.Split(Path.PathSeparator).Select(Unquoted)
                .Where(folder => Absolute.IsMatch(folder))
                .Select(folder => Joined(folder, file))
                .FirstOrDefault(path => File.Exists(path) && !IsInProject(path));
        }

        /// <summary>
        /// Returns whether a folder above a file is that of a project. The system is asked, not the
        /// names: a folder has several of them, by links and by capitals.
        /// </summary>
        static bool IsInProject(string file)
        {
            string folder = Path.GetDirectoryName(file);
            return folder != null && (IsProject(folder) || IsInProject(folder));
        }

        static bool IsProject(string folder)
        {
            return new[] { "Assets", "ProjectSettings" }.All(name => Directory.Exists(Path.Combine(folder, name)));
        }

        /// <summary>Returns a path without the quotes that Windows' Explorer copies with it.</summary>
        static string Unquoted(string path)
        {
            return path.Trim().Trim('"');
        }

        /// <summary>Returns a whole path; null if it holds what no path of this system does.</summary>
        static string Joined(string folder, string path)
        {
            try
            {
                return Path.GetFullPath(Path.Combine(folder, path));
            }
            catch (Exception error) when (error is ArgumentException || error is NotSupportedException || error is PathTooLongException)
            {
                return null;
            }
        }
    }
}
