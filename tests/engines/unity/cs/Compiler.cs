// Compiles C# with Roslyn, which Unity's editors have, as version 7.3 and as 9.0, and prints what it
// finds after a line with the version. Arguments: sources, and assemblies (.dll) that they refer to.
// It runs inside the .NET of the package that brings Roslyn; both have only what that package
// uses, which is why files are read in these roundabout ways.

using System;
using System.Collections.Generic;
using System.IO;
using Microsoft.CodeAnalysis;
using Microsoft.CodeAnalysis.CSharp;
using Microsoft.CodeAnalysis.Text;

static class Compiler
{
    static int Main(string[] paths)
    {
        Print("7.3", LanguageVersion.CSharp7_3, paths);
        Print("9.0", LanguageVersion.CSharp9, paths);
        return 0;
    }

    static void Print(string title, LanguageVersion version, string[] paths)
    {
        var parsing = new CSharpParseOptions(version);
        var sources = new List<SyntaxTree>();
        var references = new List<MetadataReference>();
        foreach (string path in paths)
        {
            var content = new MemoryStream(File.ReadAllBytes(path));
            if (path.EndsWith(".dll"))
                references.Add(MetadataReference.CreateFromStream(content));
            else
                sources.Add(CSharpSyntaxTree.ParseText(SourceText.From(content), parsing, path));
        }
        // That .NET has one thread.
        var options = new CSharpCompilationOptions(OutputKind.ConsoleApplication)
            .WithConcurrentBuild(false);
        var compilation = CSharpCompilation.Create("compiled", sources, references, options);
        Console.WriteLine(title);
        foreach (Diagnostic found in compilation.GetDiagnostics())
            if (found.Severity != DiagnosticSeverity.Hidden) Console.WriteLine(found.ToString());
    }
}
